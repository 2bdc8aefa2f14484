"""Running cases."""

from __future__ import annotations

import math
import operator
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterator, List, Optional, Tuple, Union

from . import _engine
from ._case import quantity
from ._errors import InputError, RunInterrupted, SazanamiError
from ._results import Results, States
from ._state import State
from ._tables import Table

if TYPE_CHECKING:
    from ._case import Case

__all__ = ["Run", "StepInfo", "resume"]

Time = Union[str, float]
Every = Union[int, str, float]
PathLike = Union[str, "os.PathLike[str]"]

_SLICE = 0.1
"""How long the interpreter is left at a time [s]: what Ctrl-C waits for at most."""


@dataclass(frozen=True)
class StepInfo:
    """Where a run is."""

    phase: str
    """``packing``, ``relax``, ``settle`` or ``flow``."""
    step: int
    time: float
    """Simulated time [s]."""
    until: float
    """Simulated time at which this phase ends [s]."""
    dt: float
    """Length of the step [s]."""
    limiter: str
    """Limit that ruled it."""
    pressure_iterations: int
    substeps: int
    """Sub-steps of the grains."""
    contacts: int
    """Touching pairs of contact spheres."""
    remaining: Optional[float]
    """Wall-clock time to the end of this phase [s]; ``None`` until the pace is steady."""
    fraction: float
    """Part of this phase that is done, from 0 to 1."""
    text: str
    """A line for people."""


Progress = Union[bool, Callable[[StepInfo], None]]


class _Shown:
    """Progress on the standard error: one line that is written over in a terminal, else a line for each tenth."""

    def __init__(self) -> None:
        self._tenth = ("", -1)
        self._is_terminal = sys.stderr is not None and sys.stderr.isatty()

    def __call__(self, info: StepInfo) -> None:
        if self._is_terminal:
            sys.stderr.write("\r" + info.text.ljust(79)[:79])
            sys.stderr.flush()
            return
        tenth = (info.phase, int(10 * info.fraction))
        if tenth != self._tenth:
            self._tenth = tenth
            sys.stderr.write(info.text.rstrip() + "\n")

    def end(self) -> None:
        if self._is_terminal:
            sys.stderr.write("\r" + " " * 79 + "\r")


def _whole(value: object) -> Optional[int]:
    """A whole number of any kind, NumPy's too; ``None`` for all else."""
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        return None


class Run:
    """A run of a case. :meth:`Case.start` and :func:`resume` make it; nothing happens before it is waited for or iterated.

    Once it has ended it has its results: ``series``, ``states``, ``summary``, ``results``.
    """

    def __init__(self, case: Optional["Case"], options: Dict[str, Any], progress: Progress) -> None:
        self._case = case
        self._options = options
        self._core: Optional[_engine.RunCore] = None
        self._ended: Optional[Dict[str, Any]] = None
        self._results: Optional[Results] = None
        self._is_over = False
        self._shown = _Shown() if progress is True else None
        self._progress: Optional[Callable[[StepInfo], None]] = (
            self._shown if progress is True else progress if callable(progress) else None
        )
        self.messages: List[str] = []
        """What the run said: warnings, checkpoints that were skipped, pictures written."""

    def __repr__(self) -> str:
        if self._ended is not None:
            return f"<Run: {self.status} at {self.time:.6g} s, results in {self.folder}>"
        return "<Run: failed>" if self._is_over else "<Run: going on>" if self._core else "<Run: not begun>"

    def __getstate__(self) -> Dict[str, Any]:
        self._end()
        # What it was run with is left behind; its results are read from their folder.
        held = {**self.__dict__, "_core": None, "_progress": None, "_shown": None}
        held["_results"] = self.results
        return held

    # Going on

    def wait(self, callback: Optional[Callable[[State], Any]] = None, every: Every = 1) -> "Run":
        """Runs to the end. ``callback`` gets a state every so many steps, or whenever so much time has passed."""
        if callback is None and self._core is None and not self._is_over:
            self._begin(None)
        states = self._going_on() if callback is None else self.steps(every)
        for state in states:
            if callback is not None:
                try:
                    callback(state)
                except KeyboardInterrupt:
                    self._interrupt()
                    raise
        return self

    def steps(self, every: Every = 1) -> Iterator[State]:
        """Runs step by step: a state after every so many fluid steps, ``every=10``, or whenever so much simulated time has
        passed, ``every="1 ms"``; the first and the last of the flow always.

        No step is cut for it: the run has the bits of one that nobody watched. It waits while a state is looked at. Whoever
        leaves the loop ends the run, which writes a checkpoint.
        """
        if self._core is not None or self._is_over:
            raise InputError("this run has begun already", "start another one, or go on with `sazanami.resume`")
        self._begin(every)
        return self._going_on()

    def _begin(self, every: Optional[Every]) -> None:
        by_steps = _whole(every)
        by_time = None if every is None or by_steps is not None else quantity(every, "s")
        is_wrong = by_steps is not None and by_steps < 1 or by_time is not None and not by_time > 0.0
        if isinstance(every, bool) or is_wrong:
            raise InputError(f"states cannot be seen every {every!r}", "give a number of steps, or a time with its unit")
        core = None if self._case is None else self._case._core
        self._core = _engine.RunCore.begin(core, every_steps=by_steps, every_time=by_time, **self._options)

    def _going_on(self) -> Iterator[State]:
        try:
            while not self._is_over:
                state = self._next()
                if state is not None:
                    yield state
            if self._ended is None:
                # Another thread heard first that it failed.
                self._wait()
        finally:
            # The loop was left, or an exception came through it.
            self.stop()

    def _interrupt(self) -> None:
        """Stops the run, which writes a checkpoint, and says so by an exception if that was its end."""
        assert self._core is not None
        self._core.stop(True)
        self._to_the_end()
        if self._ended is not None and self.interrupted:
            raise RunInterrupted(self.folder) from None

    def _next(self) -> Optional[State]:
        """The next state, if there is one soon."""
        try:
            # The end is kept before `progress` hears of it, which may fail or stop the run.
            found = self._wait()
            self._tell()
        except KeyboardInterrupt:
            self._interrupt()
            raise
        return State(found[1]) if found is not None and found[0] == "state" else None

    def _wait(self) -> Optional[Tuple[str, Dict[str, Any]]]:
        """A state or the end, if it comes soon. Other threads may wait too: the end is told to all of them."""
        assert self._core is not None
        try:
            found = self._core.wait(_SLICE)
        except SazanamiError:
            # The run failed.
            self._over(None)
            self._heard()
            raise
        if found is not None and found[0] == "ended":
            self._over(found[1])
        return found

    def _tell(self) -> None:
        line = self._heard()
        if line is not None and self._progress is not None:
            self._progress(StepInfo(**line))
            if self._shown is not None and self._is_over:
                self._shown.end()

    def _heard(self) -> Optional[Dict[str, Any]]:
        """The last step, if nobody has heard of it; keeps what was said."""
        assert self._core is not None
        line, messages = self._core.news()
        self.messages += messages
        return line

    def _over(self, summary: Optional[Dict[str, Any]]) -> None:
        """Keeps what came of the run; nothing takes that away again."""
        if summary is not None:
            self._ended = summary
        self._is_over = True
        if self._shown is not None:
            self._shown.end()

    def _to_the_end(self) -> None:
        """Takes what still comes and leaves it."""
        while not self._is_over:
            try:
                self._wait()
            except KeyboardInterrupt:
                # The checkpoint is being written.
                continue
        self._heard()

    def stop(self) -> None:
        """Ends the run after a checkpoint; :func:`resume` goes on with it. Nothing happens if it has ended."""
        if self._core is not None and not self._is_over:
            self._core.stop(False)
            self._to_the_end()

    # What came of it

    def _end(self) -> Dict[str, Any]:
        if self._ended is None:
            what = "failed" if self._is_over else "has not ended"
            raise InputError(f"the run {what}", "wait for its end: `run.wait()`" if not self._is_over else None)
        return self._ended

    @property
    def status(self) -> str:
        """``finished``, or ``stopped`` before the end of the case."""
        return self._end()["status"]

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped from outside."""
        return self._end()["interrupted"]

    @property
    def folder(self) -> Path:
        """Folder of the results."""
        return Path(self._end()["folder"])

    @property
    def step(self) -> int:
        """Fluid steps so far."""
        return self._end()["steps"]

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return self._end()["time"]

    @property
    def wall(self) -> float:
        """Wall-clock time of this run [s]."""
        return self._end()["wall"]

    @property
    def lines(self) -> List[str]:
        """What it found, in lines for people."""
        return self._end()["lines"]

    @property
    def results(self) -> Results:
        """The results in its folder."""
        if self._results is None:
            self._results = Results(self.folder)
        return self._results

    @property
    def series(self) -> Table:
        """A row per observation."""
        return self.results.series

    @property
    def states(self) -> States:
        """Grains and water at the times at which the run wrote them."""
        return self.results.states

    @property
    def summary(self) -> Dict[str, Any]:
        """What the run was, did and found."""
        return self.results.summary

    @property
    def crater(self) -> Optional[Dict[str, Any]]:
        """Crater and erosion volume at the end; ``None`` if the case asks for none."""
        return self.results.crater

    @property
    def ripples(self) -> Optional[Dict[str, Any]]:
        """Mound and ripples at the end, and growth of the relief; ``None`` if the case asks for none."""
        return self.results.ripples


def _time(name: str, value: Time) -> float:
    seconds = quantity(value, "s")
    if not 0.0 <= seconds < math.inf:
        raise InputError(f"`{name}` is {value!r}", "give a time of zero or more")
    return seconds


def options_of(
    folder: Optional[PathLike],
    force: bool,
    until: Optional[Time],
    steps: Optional[int],
    threads: Optional[int],
    ranks: Optional[int],
    pictures: bool,
    report: bool,
) -> Dict[str, Any]:
    """Options as the extension takes them."""
    for name, count in [("steps", steps), ("threads", threads), ("ranks", ranks)]:
        if count is not None and count < 1:
            raise InputError(f"`{name}` is {count}", "give at least 1")
    if until is not None and steps is not None:
        raise InputError("`until` and `steps` exclude one another", "give one of them")
    return {
        "folder": None if folder is None else os.fspath(folder),
        "force": force,
        "until": None if until is None else _time("until", until),
        "steps": steps,
        "threads": threads,
        "ranks": 0 if ranks is None else ranks,
        "pictures": pictures,
        "report": report,
    }


def resume(
    folder: PathLike,
    *,
    until: Optional[Time] = None,
    steps: Optional[int] = None,
    threads: Optional[int] = None,
    ranks: Optional[int] = None,
    progress: Progress = False,
    pictures: bool = True,
    report: bool = True,
    callback: Optional[Callable[[State], Any]] = None,
    every: Every = 1,
    wait: bool = True,
) -> Run:
    """Goes on from the newest good checkpoint in a folder, to the bits of a run without a break.

    Without ``wait`` the run has not begun: it is iterated, ``run.steps()``, or waited for.
    """
    run = Run(None, options_of(folder, False, until, steps, threads, ranks, pictures, report), progress)
    return run.wait(callback, every) if wait else run
