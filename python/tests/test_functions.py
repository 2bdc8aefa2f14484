"""Beds, evaluation, volume fractions."""

import numpy as np
import pytest
import sazanami
from sazanami import InputError, Mesh

# A unit cube of five tetrahedra.
NODES = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
CUBE = Mesh(NODES, np.array([[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]], dtype=np.uint32))


def positive(mesh):
    corners = mesh.nodes[mesh.tetrahedra]
    volumes = np.einsum("ij,ij->i", np.cross(*(corners[:, n] - corners[:, 0] for n in (1, 2))), corners[:, 3] - corners[:, 0])
    turned = mesh.tetrahedra.copy()
    turned[volumes < 0] = turned[volumes < 0][:, [0, 2, 1, 3]]
    return Mesh(mesh.nodes, turned)


BOX = {"lower": (0, 0, 0), "upper": (4, 4, 4), "cells": (8, 4, 4)}


def test_volume_fractions_of_a_cube():
    cube = positive(CUBE)
    found = sazanami.volume_fractions(cube, position=(1.0, 2.0, 3.0), **BOX)
    assert found.shape == (8, 4, 4)
    expected = np.zeros((8, 4, 4))
    expected[2:4, 2, 3] = 1.0
    assert found == pytest.approx(expected, abs=1e-9)
    # Turned by 90 degrees about x3, the cube lies on the other side of its corner.
    turned = sazanami.volume_fractions(cube, position=(1.0, 2.0, 3.0), orientation=(2**-0.5, 0, 0, 2**-0.5), **BOX)
    expected = np.zeros((8, 4, 4))
    expected[0:2, 2, 3] = 1.0
    assert turned == pytest.approx(expected, abs=1e-9)
    two = sazanami.volume_fractions(cube, position=[(0.25, 0.3, 0.7), (2.1, 2.2, 1.3)], scale=[1.0, 0.5], **BOX)
    assert two.sum() * 0.5 == pytest.approx(1.0 + 0.125, rel=1e-9)
    exact = sazanami.volume_fractions(cube, position=(0.3, 0.3, 0.3), **BOX)
    columns = sazanami.volume_fractions(cube, position=(0.3, 0.3, 0.3), method="columns(4)", **BOX)
    assert np.abs(columns - exact).max() < 0.1


def test_volume_fractions_of_what_is_none():
    cube = positive(CUBE)
    with pytest.raises(InputError, match="did you mean|known"):
        sazanami.volume_fractions(cube, method="clp", **BOX)
    with pytest.raises(InputError):
        sazanami.volume_fractions(cube, position=(np.nan, 0, 0), **BOX)
    with pytest.raises(InputError):
        sazanami.volume_fractions(Mesh(cube.nodes, cube.tetrahedra[:0]), **BOX)
    with pytest.raises(InputError):
        sazanami.volume_fractions(Mesh(cube.nodes, cube.tetrahedra + 100), **BOX)
    with pytest.raises(InputError):
        sazanami.volume_fractions(Mesh(cube.nodes[:, :2], cube.tetrahedra), **BOX)
    with pytest.raises(InputError):
        sazanami.volume_fractions(cube, lower=(0, 0, 0), upper=(0, 1, 1), cells=(2, 2, 2))
    with pytest.raises(InputError):
        sazanami.volume_fractions(cube, position=[(0, 0, 0)] * 2, scale=[1.0] * 3, **BOX)
    with pytest.raises(InputError):
        sazanami.read_mesh("absent.msh")


def test_meshes_of_files(tmp_path):
    cube = positive(CUBE)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(cube.nodes))]
    lines += [f"{n + 1} {x} {y} {z}" for n, (x, y, z) in enumerate(cube.nodes)]
    lines += ["$EndNodes", "$Elements", str(len(cube.tetrahedra))]
    lines += [f"{n + 1} 4 0 " + " ".join(str(c + 1) for c in t) for n, t in enumerate(cube.tetrahedra)]
    (tmp_path / "cube.msh").write_text("\n".join([*lines, "$EndElements", ""]))
    mesh = sazanami.read_mesh(tmp_path / "cube.msh", unit="1 mm")
    assert mesh.nodes.max() == 1e-3 and mesh.tetrahedra.shape == (5, 4)
    found = sazanami.volume_fractions(mesh, lower=(0, 0, 0), upper=(2e-3, 2e-3, 2e-3), cells=(2, 2, 2))
    assert found[0, 0, 0] == pytest.approx(1.0) and found.sum() == pytest.approx(1.0)


def test_packing_returns_the_bed(tmp_path):
    case = sazanami.Case.template("packing")
    case.set({"domain.size": ["6 mm", "6 mm", "12 mm"], "domain.cells": [24, 24, 48]})
    case.set({"grains.0.count": 60, "grains.1.count": 30})
    case.set({"output.bed": str(tmp_path / "small.bed"), "bed.porosity_upper": "1.2 mm"})
    bed = sazanami.pack(case, tmp_path / "packed")
    assert len(bed) == 90 and bed.position.shape == (90, 3) and bed.orientation.shape == (90, 4)
    assert np.linalg.norm(bed.orientation, axis=1) == pytest.approx(1.0)
    assert np.bincount(bed.population).tolist() == [60, 30]
    assert bed.upper == pytest.approx((6e-3, 6e-3, 12e-3)) and 0 < bed.height < 6e-3
    assert bed.position[:, 2].min() > 0 and (bed.porosity is None or 0.2 < bed.porosity < 0.9)
    again = sazanami.read_bed(tmp_path / "small.bed")
    assert np.array_equal(again.position, bed.position)
    with pytest.raises(InputError):
        sazanami.read_bed(tmp_path / "packed" / "summary.json")


def test_a_bed_that_is_interrupted_can_go_on(tmp_path, monkeypatch):
    monkeypatch.setattr(sazanami._functions.tempfile, "tempdir", str(tmp_path))
    case = sazanami.Case.template("packing")
    case.set({"domain.size": ["6 mm", "6 mm", "12 mm"], "domain.cells": [24, 24, 48]})
    case.set({"grains.0.count": 60, "grains.1.count": 30, "bed.porosity_upper": "1.2 mm"})
    case.set({"output.bed": str(tmp_path / "small.bed")})

    def interrupts(info):
        raise KeyboardInterrupt

    with pytest.raises(sazanami.RunInterrupted) as caught:
        sazanami.pack(case, progress=interrupts)
    assert caught.value.folder.is_dir()
    assert sazanami.resume(caught.value.folder, pictures=False, report=False).status == "finished"
    # Negative control: nothing is left of what came to its end.
    left = list(tmp_path.iterdir())
    assert len(sazanami.pack(case)) == 90 and list(tmp_path.iterdir()) == left


def test_evaluation_with_other_keys_needs_something_to_evaluate(run_of_drop):
    assert sazanami.analyse(run_of_drop.folder, pictures=False)
    with pytest.raises((sazanami.CaseError, InputError)):
        sazanami.evaluate(run_of_drop.folder, {"run.until": "2 ms"})
