"""Grains and water at one time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Mapping, Optional, Tuple

import numpy as np

from ._errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Arrays", "Grid", "Particles", "State"]


class Arrays(Mapping[str, "NDArray[Any]"]):
    """Named arrays of NumPy, each an attribute too."""

    def __init__(self, arrays: Dict[str, "NDArray[Any]"]) -> None:
        self._arrays = arrays

    def __getitem__(self, name: str) -> "NDArray[Any]":
        return self._arrays[name]

    def __getattr__(self, name: str) -> "NDArray[Any]":
        if name.startswith("_"):
            raise AttributeError(name)
        if name in self._arrays:
            return self._arrays[name]
        raise AttributeError(f"there is no array `{name}`; there are {', '.join(self._arrays) or 'none'}")

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        """Number of arrays."""
        return len(self._arrays)

    def __dir__(self) -> List[str]:
        return sorted({name for name in super().__dir__() if not name.startswith("_")} | set(self._arrays))

    def __repr__(self) -> str:
        listed = ", ".join(f"{name} {array.shape}" for name, array in self._arrays.items())
        return f"<{type(self).__name__}: {listed}>"

    @property
    def count(self) -> int:
        """Number of grains or particles."""
        return len(next(iter(self._arrays.values()), ()))


class Particles(Arrays):
    """Water as moving particles: ``position``, ``velocity``, ``pressure``, ``void_fraction``, ``surface``."""


class Grid(Arrays):
    """Fields on the cells of a grid, indexed ``[i, j, k]`` along x1, x2, x3; vectors have their components last.

    ``liquid_fraction``, ``pressure``, ``velocity``, and with grains ``solid_fraction`` and ``liquid_outside_grains``.
    """

    def __init__(
        self,
        arrays: Dict[str, "NDArray[Any]"],
        lower: Tuple[float, float, float],
        spacing: Tuple[float, float, float],
        cells: Tuple[int, int, int],
    ) -> None:
        super().__init__(arrays)
        self.lower = tuple(lower)
        """Lower corner of the box [m]."""
        self.spacing = tuple(spacing)
        """Edges of a cell [m]."""
        self.cells = tuple(cells)
        """Number of cells along each axis."""

    @property
    def axes(self) -> Tuple["NDArray[Any]", "NDArray[Any]", "NDArray[Any]"]:
        """Centres of the cells along x1, x2 and x3 [m]."""
        x, y, z = (self.lower[d] + self.spacing[d] * (np.arange(self.cells[d]) + 0.5) for d in range(3))
        return x, y, z

    @property
    def cell_volume(self) -> float:
        """Volume of a cell [m^3]."""
        return self.spacing[0] * self.spacing[1] * self.spacing[2]


class State:
    """Grains and water at one time, in SI units."""

    def __init__(self, raw: Dict[str, Any]) -> None:
        self.time: float = raw["time"]
        """Simulated time [s]."""
        self.step: Optional[int] = raw["step"]
        """Fluid step; ``None`` of a state in a file."""
        self.grains = Arrays(raw["grains"])
        """Arrays of the grains in the order of ``id``; ``orientation``, a unit quaternion w, x, y, z, turns the shape as it was given."""
        water = raw["water"]
        self.grid: Optional[Grid] = None
        """Fields on the grid, for ``solver = "mics"``."""
        self.particles: Optional[Particles] = None
        """The water, for ``solver = "mps"``."""
        if water is not None and "cells" in water:
            self.grid = Grid(water["arrays"], water["lower"], water["spacing"], water["cells"])
        elif water is not None:
            self.particles = Particles(water["arrays"])

    def __repr__(self) -> str:
        water = self.grid if self.grid is not None else self.particles
        return f"<State at {self.time:.6g} s: {self.grains.count} grains, {water!r}>"

    def to_pyvista(self) -> Any:
        """A ``pyvista.MultiBlock`` with the blocks ``grains`` and ``water``, those that there are."""
        try:
            import pyvista
        except ImportError:
            raise ImportError("pyvista is not installed: `pip install pyvista`") from None
        blocks = pyvista.MultiBlock()
        for name, arrays in [("grains", self.grains), ("water", self.particles)]:
            if arrays is not None and "position" in arrays:
                points = pyvista.PolyData(np.ascontiguousarray(arrays["position"]))
                for key, array in arrays.items():
                    if key != "position":
                        points.point_data[key] = array
                blocks[name] = points
        if self.grid is not None:
            image = pyvista.ImageData(
                dimensions=tuple(n + 1 for n in self.grid.cells), spacing=self.grid.spacing, origin=self.grid.lower
            )
            for key, array in self.grid.items():
                # x1 is fastest in VTK too: the array as it lies in memory.
                order = (2, 1, 0) if array.ndim == 3 else (2, 1, 0, 3)
                flat = array.transpose(order)
                image.cell_data[key] = flat.reshape(-1) if array.ndim == 3 else flat.reshape(-1, array.shape[3])
            blocks["water"] = image
        if not len(blocks):
            raise InputError("this state has neither grains nor water", "let the case write them: `[output]`")
        return blocks
