"""Tables that runs wrote."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Mapping, Sequence, Tuple, Union

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Table"]


class Table(Mapping[str, "NDArray[Any]"]):
    """Columns of a table by their names, with their units: arrays of numbers, NaN where a cell is empty, or of words."""

    def __init__(self, columns: Sequence[Tuple[str, str, Union["NDArray[Any]", List[str]]]]) -> None:
        self._columns: Dict[str, "NDArray[Any]"] = {
            name: np.asarray(values, dtype=object) if isinstance(values, list) else values
            for name, _, values in columns
        }
        self.units: Dict[str, str] = {name: unit for name, unit, _ in columns}
        """Unit of each column; empty where it has none."""

    def __getitem__(self, name: str) -> "NDArray[Any]":
        if name not in self._columns:
            raise KeyError(f"there is no column `{name}`; there are {', '.join(self._columns)}")
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        """Number of columns."""
        return len(self._columns)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self._columns.values()), ()))

    def __repr__(self) -> str:
        return f"<Table: {self.rows} rows of {', '.join(self._columns)}>"

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame``; ``attrs["units"]`` has the units."""
        try:
            import pandas
        except ImportError:
            raise ImportError("pandas is not installed: `pip install pandas`") from None
        frame = pandas.DataFrame(dict(self._columns))
        frame.attrs["units"] = dict(self.units)
        return frame

    def to_polars(self) -> Any:
        """A ``polars.DataFrame``."""
        try:
            import polars
        except ImportError:
            raise ImportError("polars is not installed: `pip install polars`") from None
        return polars.DataFrame(
            {name: list(values) if values.dtype == object else values for name, values in self._columns.items()}
        )
