"""Exceptions: the same causes, places and suggestions as the messages of the command ``sazanami``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

__all__ = [
    "CaseError",
    "Finding",
    "InputError",
    "InternalError",
    "RunFailed",
    "RunInterrupted",
    "SazanamiError",
    "UndoneError",
    "UnknownKeyError",
]


@dataclass(frozen=True)
class Finding:
    """One thing that was found of a case, and where."""

    severity: str
    """``error`` or ``warning``."""
    message: str
    """What is wrong, in one line."""
    file: str
    """Case file, or ``--set`` for a key that was set over it."""
    line: Optional[int] = None
    """Line, from 1; absent where it is about the whole file."""
    column: Optional[int] = None
    """Column in characters, from 1."""
    expected: Optional[str] = None
    """What was expected there."""
    suggestion: Optional[str] = None
    """One thing to do."""

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}:{self.column}"
        parts = [f"{self.severity}: {self.message}", f"  at {place}"]
        parts += [f"  {self.expected}"] if self.expected else []
        parts += [f"  help: {self.suggestion}"] if self.suggestion else []
        return "\n".join(parts)


class SazanamiError(Exception):
    """Base of all exceptions of this package."""

    exit_code = 1
    """Exit code of the command for the same cause."""

    def __reduce__(self) -> Any:
        return _again, (type(self), self.args, self.__dict__)


class InputError(SazanamiError, ValueError):
    """An argument, or what it names, cannot be used: a folder without results, one in use, ..."""

    exit_code = 2

    def __init__(self, message: str, suggestion: Optional[str] = None) -> None:
        super().__init__(message if suggestion is None else f"{message}\n  help: {suggestion}")
        self.message = message
        self.suggestion = suggestion


class CaseError(SazanamiError, ValueError):
    """A case is wrong. ``findings`` has all that was found at once; the attributes are those of the first error."""

    exit_code = 2

    def __init__(self, text: str, findings: Sequence[Any]) -> None:
        super().__init__(text.rstrip())
        self.findings: List[Finding] = [f if isinstance(f, Finding) else Finding(**f) for f in findings]

    @property
    def _first(self) -> Finding:
        return self.findings[0] if self.findings else Finding("error", str(self), "")

    @property
    def message(self) -> str:
        """What is wrong, in one line."""
        return self._first.message

    @property
    def file(self) -> str:
        """Case file, or ``--set`` for a key that was set over it."""
        return self._first.file

    @property
    def line(self) -> Optional[int]:
        """Line, from 1."""
        return self._first.line

    @property
    def column(self) -> Optional[int]:
        """Column in characters, from 1."""
        return self._first.column

    @property
    def expected(self) -> Optional[str]:
        """What was expected there."""
        return self._first.expected

    @property
    def suggestion(self) -> Optional[str]:
        """One thing to do."""
        return self._first.suggestion


class UnknownKeyError(CaseError, AttributeError, KeyError):
    """There is no such key; ``suggestion`` names the nearest one."""

    def __init__(self, path: str, meant: Optional[str]) -> None:
        suggestion = f"did you mean `{meant}`?" if meant else "`sazanami.explain()` lists the tables"
        message = f"there is no key `{path}`"
        super().__init__(f"{message}\n  help: {suggestion}", [Finding("error", message, "", suggestion=suggestion)])
        self.path = path
        self.meant = meant

    def __str__(self) -> str:
        # KeyError would show the text in quotes.
        return str(self.args[0])


class RunFailed(SazanamiError, RuntimeError):
    """A run ended by an error of the physics or of the machine."""

    def __init__(
        self,
        text: str,
        *,
        kind: str,
        message: str,
        step: int,
        time: float,
        limiter: str,
        rank: Optional[int],
        checkpoint: Optional[str],
    ) -> None:
        super().__init__(text)
        self.kind = kind
        """In one word: ``not_finite``, ``overlap``, ``pressure``, ``disk``, ..."""
        self.message = message
        """What happened, with the grain or cell and its position."""
        self.step = step
        """Fluid step at which it failed."""
        self.time = time
        """Simulated time [s]."""
        self.limiter = limiter
        """Limit that ruled the length of the step."""
        self.rank = rank
        """Rank that failed, where it was one of several."""
        self.checkpoint = None if checkpoint is None else Path(checkpoint)
        """Newest good checkpoint."""


class UndoneError(SazanamiError, OSError):
    """Something beside a run could not be had: a table, a picture, a report."""


class InternalError(SazanamiError, RuntimeError):
    """A fault of the program."""

    def __init__(self, cause: str) -> None:
        super().__init__(f"this is a fault of the program, please report it: {cause}")
        self.cause = cause


class RunInterrupted(KeyboardInterrupt):
    """Ctrl-C ended a run after it wrote a checkpoint; ``folder`` is what :func:`sazanami.resume` goes on with."""

    def __reduce__(self) -> Any:
        return _again, (type(self), self.args, self.__dict__)

    def __init__(self, folder: Path) -> None:
        super().__init__(f"stopped by Ctrl-C after a checkpoint; go on with sazanami.resume({str(folder)!r})")
        self.folder = folder


def _again(kind: Any, arguments: Any, attributes: Dict[str, Any]) -> Any:
    """An exception as it was, from another process."""
    error = kind.__new__(kind, *arguments)
    error.args = arguments
    error.__dict__.update(attributes)
    return error
