"""Keys of a case as attributes."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Sequence, Tuple, Union

from ._errors import InputError

if TYPE_CHECKING:
    from ._case import Case

Names = Tuple[str, ...]
Path = Union[str, Sequence[Union[str, int]]]


def names_of(path: Path) -> Names:
    """The names of a path such as ``liquid.0.fall.speed``; names with dots in them are given as a list."""
    if isinstance(path, str):
        return tuple(path.split("."))
    return tuple(str(name) for name in path)


def as_json(names: Names, value: Any) -> str:
    """A value as JSON: numbers of NumPy and paths too."""

    def other(inner: Any) -> Any:
        if isinstance(inner, Keys):
            return inner.as_dict()
        if hasattr(inner, "tolist"):
            return inner.tolist()
        if isinstance(inner, os.PathLike):
            return os.fspath(inner)
        raise InputError(
            f"`{'.'.join(names)}` cannot be set to {inner!r}", "give a number, a text, a list or a dict"
        )

    if value is None:
        raise InputError(
            f"`{'.'.join(names)}` cannot be set to None", "pose the case anew without the key, from a file or a text"
        )
    try:
        return json.dumps(value, default=other, allow_nan=False)
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"`{'.'.join(names)}` is not finite", "give a finite number") from None


class Keys:
    """A table of a case, or a list of tables: its keys are attributes, and what is below them too.

    Quantities are numbers in SI units when read; they are set as such numbers or as text with a unit. A key that there is
    not is refused with the nearest one.
    """

    __slots__ = ("_case", "_names")

    def __init__(self, case: "Case", names: Names) -> None:
        object.__setattr__(self, "_case", case)
        object.__setattr__(self, "_names", names)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self._case.get(self._names + (name,))

    def __setattr__(self, name: str, value: Any) -> None:
        self._case.set({self._names + (name,): value})

    def __getitem__(self, name: Union[str, int]) -> Any:
        if isinstance(name, int) and name < 0:
            name += len(self)
        return self._case.get(self._names + (str(name),))

    def __setitem__(self, name: Union[str, int], value: Any) -> None:
        if isinstance(name, int) and name < 0:
            name += len(self)
        self._case.set({self._names + (str(name),): value})

    def _held(self) -> Any:
        return self._case._value(self._names)

    def __len__(self) -> int:
        return len(self._held() or ())

    def __contains__(self, name: object) -> bool:
        held = self._held()
        return isinstance(held, dict) and name in held

    def __iter__(self) -> Iterator[Any]:
        held = self._held() or {}
        if isinstance(held, list):
            return iter([self[n] for n in range(len(held))])
        return iter(list(held))

    def keys(self) -> List[str]:
        """Names of the keys that have a value."""
        held = self._held()
        return list(held) if isinstance(held, dict) else []

    def as_dict(self) -> Any:
        """All of it as dictionaries, lists and numbers in SI units."""
        held: Union[Dict[str, Any], List[Any], None] = self._held()
        return json.loads(json.dumps({} if held is None else held))

    def __dir__(self) -> List[str]:
        return sorted(set(self._case._known(self._names)["keys"]) | set(self.keys()))

    def __reduce__(self) -> Any:
        return type(self), (self._case, self._names)

    def __eq__(self, other: object) -> bool:
        return self.as_dict() == (other.as_dict() if isinstance(other, Keys) else other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<{'.'.join(self._names)}: {self._held()!r}>"
