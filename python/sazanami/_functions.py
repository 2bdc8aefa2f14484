"""Parts of the engine by themselves: beds, evaluation of results, volume fractions."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _engine
from ._keys import as_json, names_of
from ._errors import InputError, RunFailed, RunInterrupted
from ._results import Results

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._case import Case

__all__ = ["Bed", "Mesh", "analyse", "evaluate", "pack", "read_bed", "read_mesh", "volume_fractions"]

PathLike = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class Bed:
    """Grains at rest."""

    position: "NDArray[np.float64]"
    """Centres of mass [m], a row for each grain."""
    orientation: "NDArray[np.float64]"
    """Unit quaternions w, x, y, z, from the principal axes of the shapes; those of a mesh need not be the axes it was drawn in."""
    scale: "NDArray[np.float64]"
    """Factors on the size of their shapes."""
    population: "NDArray[np.uint32]"
    """Number of the population of each grain."""
    lower: Tuple[float, float, float]
    """Lower corner of the box [m]."""
    upper: Tuple[float, float, float]
    """Upper corner [m]."""
    recipe: Dict[str, Any]
    """Where the bed comes from and what was measured of it: ``porosity``, ``height``, ..."""

    @property
    def porosity(self) -> Optional[float]:
        """Porosity of the slab that the case gives; ``None`` if that lies above the bed."""
        return self.recipe["porosity"]

    @property
    def height(self) -> float:
        """Highest node near the axis [m]."""
        return self.recipe["height"]

    def __len__(self) -> int:
        return len(self.scale)


def read_bed(path: PathLike) -> Bed:
    """The bed in a file."""
    return Bed(**_engine.bed(path))


def pack(
    case: "Case", folder: Optional[PathLike] = None, *, threads: Optional[int] = None, progress: Any = False
) -> Bed:
    """Packs the bed of a case and returns it at rest; its files stay in ``folder``, if one is given. Without it they are removed,
    unless the packing fails or is ended by Ctrl-C: the exception names the place that :func:`resume` goes on with."""
    only = case.with_keys({"run.packing_only": True})
    scratch = None
    if folder is None:
        scratch = tempfile.mkdtemp(prefix="sazanami-")
        folder = Path(scratch) / "bed"
    is_kept = False
    try:
        only.run(folder=folder, threads=threads, progress=progress, pictures=False, report=False)
        path = only.output.bed or Path(folder) / "packed.bed"
        if not Path(path).is_file():
            raise InputError("the case packs no bed", "give a population `placement.packed`")
        return read_bed(path)
    except (RunFailed, RunInterrupted):
        is_kept = True
        raise
    finally:
        if scratch is not None and not is_kept:
            shutil.rmtree(scratch, ignore_errors=True)


def analyse(
    folders: Union[PathLike, Sequence[PathLike]],
    keys: Optional[Mapping[Any, Any]] = None,
    *,
    out: Optional[PathLike] = None,
    pictures: bool = True,
) -> List[str]:
    """Evaluates one run again, with other keys if they are given, or compares several; returns lines for people.

    As ``sazanami analyse``: what is found with other keys goes into the folder ``analysis`` of the run, tables of
    a comparison into ``out``.
    """
    several = [folders] if isinstance(folders, (str, os.PathLike)) else list(folders)
    settings = [(list(names_of(path)), as_json(names_of(path), value)) for path, value in (keys or {}).items()]
    lines, _ = _engine.analyse_folders(several, settings, out, pictures)
    return lines


def evaluate(folder: PathLike, keys: Optional[Mapping[Any, Any]] = None) -> Dict[str, Any]:
    """What a run found, as numbers: crater or ripples. With ``keys``, such as ``{"erosion.dr": "1 mm"}`` or
    ``{"ripples.margin": "15 mm"}``, it is evaluated again with them."""
    if not keys:
        return Results(folder).observables
    analyse(folder, keys, pictures=False)
    found = json.loads((Path(folder) / "analysis" / "summary.json").read_text(encoding="utf-8"))
    return found["observables"]


@dataclass(frozen=True)
class Mesh:
    """A solid of tetrahedra."""

    nodes: "NDArray[np.float64]"
    """Places of the nodes [m], a row each."""
    tetrahedra: "NDArray[np.uint32]"
    """Nodes of each tetrahedron, positively oriented."""


def read_mesh(path: PathLike, unit: Union[str, float] = 1.0) -> Mesh:
    """The solid in a file of Gmsh, whose numbers are in ``unit``, such as ``"1 mm"``."""
    from ._case import quantity

    nodes, tetrahedra = _engine.read_mesh(path, quantity(unit, "m"))
    return Mesh(nodes, np.asarray(tetrahedra, dtype=np.uint32).reshape(-1, 4))


def volume_fractions(
    mesh: Mesh,
    *,
    lower: Sequence[float],
    upper: Sequence[float],
    cells: Sequence[int],
    position: "ArrayLike" = (0.0, 0.0, 0.0),
    orientation: "ArrayLike" = (1.0, 0.0, 0.0, 0.0),
    scale: "ArrayLike" = 1.0,
    method: str = "clip",
) -> "NDArray[np.float64]":
    """The part of each cell of a box that bodies of one mesh cover, indexed ``[i, j, k]``.

    The mesh is multiplied by ``scale``, turned by the quaternion ``orientation`` (w, x, y, z) and moved by ``position``, each of
    them one or a row for every body. Where bodies overlap their parts add up; what lies outside the box is left out.
    ``method`` is ``clip`` (exact) or ``columns(4)`` (that of runs).
    """
    places = np.atleast_2d(np.asarray(position, dtype=np.float64))
    turns = np.atleast_2d(np.asarray(orientation, dtype=np.float64))
    scales = np.atleast_1d(np.asarray(scale, dtype=np.float64))
    count = max(len(places), len(turns), len(scales))
    try:
        rows = np.hstack(
            [
                np.broadcast_to(places, (count, 3)),
                np.broadcast_to(turns, (count, 4)),
                np.broadcast_to(scales[:, None], (count, 1)),
            ]
        )
    except ValueError as error:
        raise InputError(f"places, turns and scales do not fit one another: {error}", "give one, or a row a body") from None
    flat = _engine.volume_fractions(
        np.ascontiguousarray(mesh.nodes, dtype=np.float64),
        np.ascontiguousarray(mesh.tetrahedra, dtype=np.uint32),
        np.ascontiguousarray(rows),
        tuple(float(x) for x in lower),
        tuple(float(x) for x in upper),
        tuple(int(n) for n in cells),
        method,
    )
    n1, n2, n3 = (int(n) for n in cells)
    return flat.reshape(n3, n2, n1).transpose(2, 1, 0)
