"""Cases: posed from files, texts or templates, changed key by key, checked, and run."""

from __future__ import annotations

import copy
import math
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Tuple, Union

from . import _engine
from ._keys import Keys, Names, Path, as_json, names_of
from ._errors import Finding

if TYPE_CHECKING:
    from ._run import Run

__all__ = ["Case", "Check", "Limit", "explain", "quantity", "templates"]

PathLike = Union[str, "os.PathLike[str]"]


def templates() -> Dict[str, str]:
    """Names of the templates of :meth:`Case.template`, each with what happens in it."""
    return dict(_engine.templates())


def explain(path: str = "") -> str:
    """What is declared of a key: its meaning, unit, range and default; without a path, the tables."""
    return _engine.explain(path)


def quantity(value: Union[str, float], unit: str) -> float:
    """The SI value of a text such as ``"20 ms"``; a number is taken as one in ``unit``: 5 in ``"mm"`` is 0.005."""
    if isinstance(value, str):
        return _engine.quantity(value, unit)
    number = float(value)
    return _engine.quantity(f"{number!r} {unit}", unit) if math.isfinite(number) else number


@dataclass(frozen=True)
class Limit:
    """A limit on the length of a step."""

    name: str
    dt: float
    """Longest step it allows at the start [s]."""
    rule: str
    """How it is found."""
    rules: bool
    """Whether it rules at the start."""


@dataclass(frozen=True)
class Check:
    """What can be said of a case before it runs."""

    report: Dict[str, Any]
    """All of it, as ``sazanami check --json`` has it."""
    warnings: List[Finding]
    """What should be looked at."""
    messages: List[str]
    """What was found beside the case, such as a tank prepared before."""
    text: str
    """The report for people."""

    @property
    def limits(self) -> List[Limit]:
        """Limits on the step at the start, shortest first."""
        return [Limit(l["name"], l["dt_s"], l["rule"], l["rules"]) for l in self.report["limits"]]

    @property
    def dt(self) -> float:
        """Step at the start [s]."""
        return self.report["dt_s"]

    @property
    def steps(self) -> float:
        """Fluid steps, if the step stays as it is at the start."""
        return self.report["steps"]

    @property
    def cost(self) -> Dict[str, float]:
        """Wall-clock time by part on this machine [s], predicted."""
        return dict(self.report["predicted_s"])

    @property
    def seconds(self) -> Tuple[float, float]:
        """Wall-clock time in all [s]: with the step of the start, and with that of the speeds that bodies reach."""
        return self.report["predicted_total_s"], self.report["predicted_most_s"]

    @property
    def memory(self) -> float:
        """Memory [bytes]."""
        return self.report["memory_bytes"]

    @property
    def disk(self) -> float:
        """Results on disk [bytes]."""
        return self.report["disk_bytes"]

    def __str__(self) -> str:
        return "\n".join([str(w) for w in self.warnings] + self.messages + [self.text])


class Case:
    """A case: everything a run needs to know.

    Keys are attributes, ``case.fluid.cfl``, elements of lists by their number, ``case.liquid[0].fall.speed``, and names of
    one's own in brackets, ``case.contact["sand/sand"].friction``. A case is always one that can be read: a key that would
    break it is refused and changes nothing. Keys that only make sense together are set together by :meth:`set`. Cases that
    mean the same are equal, however they were written.
    """

    __slots__ = ("_core", "_values")

    def __init__(self, core: _engine.CaseCore) -> None:
        """Use :meth:`from_file`, :meth:`from_text` or :meth:`template`."""
        object.__setattr__(self, "_core", core)
        object.__setattr__(self, "_values", None)

    @classmethod
    def from_file(cls, path: PathLike) -> "Case":
        """The case in a file; files that it names are relative to its folder."""
        return cls(_engine.CaseCore.from_file(path))

    @classmethod
    def from_text(cls, text: str, path: PathLike = "case.toml") -> "Case":
        """The case in a text. ``path`` gives its name, and the folder that files in it are relative to."""
        return cls(_engine.CaseCore.from_text(text, path))

    @classmethod
    def template(cls, name: str) -> "Case":
        """A case to start from; :func:`templates` lists them."""
        return cls(_engine.CaseCore.template(name))

    def get(self, path: Path) -> Any:
        """The value of a key, in SI units; a table as :class:`Keys`; ``None`` of a key that has none.

        Lists are copies: they are set whole.
        """
        names = names_of(path)
        held = self._value(names)
        if isinstance(held, dict) or (isinstance(held, list) and held and all(isinstance(x, dict) for x in held)):
            return self._keys(names)
        if held is not None:
            return copy.deepcopy(held)
        for n, name in enumerate(names):
            if name.isdigit() and self._value(names[: n + 1]) is None:
                raise IndexError(f"`{'.'.join(names[:n])}` has no element {name}")
        return None if self._known(names)["holds"] == "value" else self._keys(names)

    def set(self, keys: Mapping[Any, Any]) -> None:
        """Sets several keys at once, ``{"run.until": "20 ms", "liquid.0.fall.speed": 4.5}``.

        Quantities are texts with a unit or numbers in SI units.
        """
        named = [(names_of(path), value) for path, value in keys.items()]
        core = self._core.with_keys([(list(names), as_json(names, value)) for names, value in named])
        object.__setattr__(self, "_core", core)
        object.__setattr__(self, "_values", None)

    def with_keys(self, keys: Mapping[Any, Any]) -> "Case":
        """Another case, in which these keys are set."""
        case = self.copy()
        case.set(keys)
        return case

    def copy(self) -> "Case":
        """The same case, to be changed by itself."""
        return type(self)(self._core)

    @property
    def run(self) -> "_RunTable":
        """Runs the case, ``case.run(until="20 ms")``; its keys are those of the table ``run``, ``case.run.until``."""
        return _RunTable(self, ("run",))

    def start(
        self,
        *,
        until: Optional[Union[str, float]] = None,
        steps: Optional[int] = None,
        folder: Optional[PathLike] = None,
        force: bool = False,
        threads: Optional[int] = None,
        ranks: int = 1,
        progress: Any = False,
        pictures: bool = True,
        report: bool = True,
    ) -> "Run":
        """A run that has not begun: ``for state in case.start(until="5 ms").steps(every="1 ms"): ...``.

        ``until`` (simulated time) or ``steps`` (fluid steps) end it before the end of the case. ``folder`` takes the results: the
        next free ``runs/NAME-N`` if it is not given; ``force`` overwrites one that is not empty. ``threads``: all. ``progress`` shows
        where the run is, or calls a function with a :class:`StepInfo`. Without ``pictures`` and ``report`` the folder has tables,
        files for ParaView and checkpoints alone.
        """
        from ._run import Run, options_of

        options = options_of(folder, force, until, steps, threads, ranks, pictures, report)
        return Run(self.copy(), options, progress)

    def __copy__(self) -> "Case":
        return self.copy()

    def __deepcopy__(self, memo: Any) -> "Case":
        return self.copy()

    def __reduce__(self) -> Any:
        return _restored, self._core.parts()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self.get((name,))

    def __setattr__(self, name: str, value: Any) -> None:
        self.set({(name,): value})

    def __getitem__(self, path: Path) -> Any:
        return self.get(path)

    def __setitem__(self, path: Path, value: Any) -> None:
        self.set({path if isinstance(path, str) else tuple(path): value})

    def __dir__(self) -> List[str]:
        public = {name for name in super().__dir__() if not name.startswith("_")}
        return sorted(public | set(self._known(())["keys"]))

    def __eq__(self, other: object) -> bool:
        return self.hash == other.hash if isinstance(other, Case) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Case {self._core.name}, hash {self._core.hash}>"

    @property
    def hash(self) -> str:
        """Hash of what the case means: the same wherever it lies and however it was written."""
        return self._core.hash

    @property
    def text(self) -> str:
        """The case file that says everything: every default, SI units, names of files from the root. It may lie anywhere."""
        return self._core.resolved()

    @property
    def changed(self) -> Dict[str, str]:
        """Keys that are required or differ from their defaults, with their values as text."""
        return {path: value for path, value, _ in self._core.changed()}

    def as_dict(self) -> Dict[str, Any]:
        """Every key with its value in SI units."""
        return self._core.values()

    def check(self, threads: Optional[int] = None, ranks: Optional[int] = None) -> Check:
        """Validates the case without running it: resolution, limits, memory, disk and cost, on so many threads (all).

        Raises :class:`CaseError` if it cannot run.
        """
        found = self._core.check(threads, ranks)
        warnings = [Finding(**record) for record in found["warnings"]]
        return Check(found["report"], warnings, found["messages"], found["text"])

    def _keys(self, names: Names) -> Keys:
        return Keys(self, names)

    def _known(self, names: Names) -> Dict[str, Any]:
        return _engine.CaseCore.known(list(names))

    def _value(self, names: Names) -> Any:
        if self._values is None:
            object.__setattr__(self, "_values", self._core.values())
        held: Any = self._values
        for name in names:
            if isinstance(held, dict):
                held = held.get(name)
            elif isinstance(held, list) and name.isdigit() and int(name) < len(held):
                held = held[int(name)]
            else:
                return None
        return held


class _RunTable(Keys):
    """The table ``run`` of a case, which can be called to run it."""

    __slots__ = ()

    def __call__(
        self,
        *,
        until: Optional[Union[str, float]] = None,
        steps: Optional[int] = None,
        folder: Optional[PathLike] = None,
        force: bool = False,
        threads: Optional[int] = None,
        ranks: int = 1,
        progress: Any = False,
        pictures: bool = True,
        report: bool = True,
        callback: Any = None,
        every: Union[int, str, float] = 1,
    ) -> "Run":
        """Runs the case to its end and returns the run with its results; the options are those of :meth:`Case.start`.

        ``callback`` gets a :class:`State` ``every`` so many steps, or whenever so much simulated time has passed. Ctrl-C ends the run
        after a checkpoint and raises :class:`RunInterrupted`.
        """
        run = self._case.start(
            until=until,
            steps=steps,
            folder=folder,
            force=force,
            threads=threads,
            ranks=ranks,
            progress=progress,
            pictures=pictures,
            report=report,
        )
        return run.wait(callback, every)


def _restored(text: str, path: PathLike, settings: List[str]) -> Case:
    return Case(_engine.CaseCore.of_parts(text, path, settings))
