"""Results in folders."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Sequence, Union

from . import _engine
from ._case import Case, quantity
from ._errors import InputError
from ._state import State
from ._tables import Table

__all__ = ["Results", "States"]


class States(Sequence[State]):
    """The states that a run wrote, read from its files when they are asked for."""

    def __init__(self, core: _engine.ResultsCore, folder: Path) -> None:
        self._core = core
        self._folder = folder
        self.times: List[float] = core.times()
        """Simulated times [s]."""

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        span = f", {self.times[0]:g} to {self.times[-1]:g} s" if self.times else ""
        return f"<{len(self)} states{span}>"

    def __getitem__(self, number: Any) -> Any:
        if isinstance(number, slice):
            return [self[n] for n in range(*number.indices(len(self)))]
        at = number + len(self) if number < 0 else number
        if not 0 <= at < len(self):
            raise IndexError(f"there is no state {number}: the run wrote {len(self)}")
        return State(self._core.state(at))

    def __iter__(self) -> Iterator[State]:
        return (self[n] for n in range(len(self)))

    def __reduce__(self) -> Any:
        return _states_in, (self._folder,)

    def at(self, time: Union[str, float]) -> State:
        """The state written nearest to a time, text with a unit or a number [s], from the first that was written to the end of
        the run."""
        if not self.times:
            raise InputError("the run wrote neither grains nor water", "let the case write them: `[output]`")
        time = quantity(time, "s")
        first, end = self.times[0], max(self.times[-1], self._core.summary().get("time_s") or 0.0)
        within = 1e-9 * end
        if not first - within <= time <= end + within:
            raise InputError(f"there is no state at {time:g} s", f"the run wrote states from {first:g} s to {end:g} s")
        return self[min(range(len(self)), key=lambda n: abs(self.times[n] - time))]


class Results:
    """A folder that a run wrote its results to, of a run that has ended: ``Results("runs/quick-1")``.

    Raises :class:`InputError` with the cause if the folder holds no results, a run still writes to it or broke off, another
    version wrote it, or a table is damaged.
    """

    def __init__(self, folder: Union[str, "os.PathLike[str]"]) -> None:
        self._core = _engine.ResultsCore.open(folder)
        self.folder = Path(folder)
        """The folder."""

    def __reduce__(self) -> Any:
        # What is read is read again from the same folder, wherever that is done.
        return Results, (self.folder.absolute(),)

    def __repr__(self) -> str:
        return f"<Results in {self.folder}>"

    @property
    def summary(self) -> Dict[str, Any]:
        """What the run was, did and found: ``summary.json``."""
        return self._core.summary()

    @property
    def status(self) -> str:
        """``finished``, ``stopped`` or ``failed``."""
        return self.summary["status"]

    @property
    def case(self) -> Case:
        """The case as it was run."""
        return Case(self._core.case())

    @property
    def series(self) -> Table:
        """A row per observation: ``series.csv``."""
        return Table(self._core.series())

    def table(self, name: str) -> Table:
        """Another table of the run, such as ``profiles.csv``, ``bed.csv``, ``water.csv`` or ``layers.csv``."""
        found = self._core.table(name)
        if found is None:
            raise InputError(f"`{self.folder}` has no table `{name}`", f"there are {', '.join(self.tables) or 'none'}")
        return Table(found)

    @property
    def tables(self) -> List[str]:
        """Names of the tables of the run."""
        found = [path.relative_to(self.folder) for path in self.folder.rglob("*.csv")]
        return sorted(path.as_posix() for path in found)

    @property
    def findings(self) -> Dict[str, str]:
        """What the run found, for people: labels and values with their units."""
        return dict(self._core.findings())

    @property
    def observables(self) -> Dict[str, Any]:
        """What the run found, as numbers: the part ``observables`` of the summary."""
        return self.summary.get("observables", {})

    @property
    def crater(self) -> Optional[Dict[str, Any]]:
        """Crater and erosion volume at the end; ``None`` if the case asks for none."""
        return self.observables.get("erosion")

    @property
    def ripples(self) -> Optional[Dict[str, Any]]:
        """Mound and ripples of the bed at the end, and growth of its relief; ``None`` if the case asks for none."""
        return self.observables.get("ripples")

    @property
    def states(self) -> States:
        """Grains and water at the times at which the run wrote them."""
        return States(self._core, self.folder.absolute())


def _states_in(folder: Path) -> States:
    return Results(folder).states
