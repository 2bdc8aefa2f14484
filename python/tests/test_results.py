"""Results in folders, sound and damaged."""

import json
import pickle
import shutil

import numpy as np
import pytest
import sazanami
from sazanami import InputError, Results


@pytest.fixture
def results(run_of_drop):
    return Results(run_of_drop.folder)


@pytest.fixture
def copied(run_of_drop, tmp_path):
    return shutil.copytree(run_of_drop.folder, tmp_path / "copy")


def test_tables_have_names_units_and_arrays(results):
    series = results.series
    assert series.units["time"] == "s" and series["time"].dtype == np.float64
    assert series.rows == len(series["time"]) > 2
    assert series["limiter"].dtype == object and any(series["limiter"])
    assert set(series) == set(series.units)
    with pytest.raises(KeyError, match="there is no column"):
        series["tim"]
    assert "series.csv" in results.tables
    assert results.table("series.csv").rows == series.rows
    with pytest.raises(InputError, match="no table"):
        results.table("bed.csv")


def test_tables_for_others(results):
    for package, method in [("pandas", "to_pandas"), ("polars", "to_polars")]:
        try:
            __import__(package)
        except ImportError:
            with pytest.raises(ImportError, match=f"{package} is not installed"):
                getattr(results.series, method)()
        else:
            frame = getattr(results.series, method)()
            assert list(frame["time"]) == list(results.series["time"])


def test_states_are_read_from_files(results):
    states = results.states
    assert states.times == pytest.approx([0.0, 0.25e-3, 0.5e-3, 0.75e-3, 1e-3])
    assert len(states) == 5 and len(states[1:3]) == 2
    first, last = states[0], states[-1]
    assert first.grains.position.shape == (3, 3)
    assert first.grains.position == pytest.approx(np.array([[1.5, 3, 0.6], [3, 3, 0.6], [4.5, 3, 0.6]]) * 1e-3)
    assert first.grid.liquid_fraction.shape == (12, 12, 12)
    assert states[1].grid is None and states.at(0.6e-3).time == pytest.approx(0.5e-3)
    assert last.time == pytest.approx(1e-3)
    assert states.at("0.6 ms").time == states.at(0.6e-3).time and states.at(1e-3).time == last.time
    for out_of_range in [-1e-3, 1.1e-3, 1.0, float("nan"), "2 s"]:
        with pytest.raises(InputError, match="there is no state at"):
            states.at(out_of_range)
    with pytest.raises(IndexError):
        states[5]
    with pytest.raises(AttributeError, match="there is no array `spin`"):
        last.grains.spin


def test_files_hold_what_was_seen(drop, tmp_path, results):
    run = drop.start(folder=tmp_path / "a", pictures=False, report=False)
    seen = list(run.steps(every="0.5 ms"))[-1]
    read = results.states[-1]
    assert read.grid.liquid_fraction == pytest.approx(seen.grid.liquid_fraction, abs=1e-6)
    assert read.grid.velocity == pytest.approx(seen.grid.velocity, rel=1e-5, abs=1e-6)
    assert read.grid.axes[0] == pytest.approx(seen.grid.axes[0])
    assert read.grains.position == pytest.approx(seen.grains.position, rel=1e-6)
    assert read.grains.orientation == pytest.approx(seen.grains.orientation, abs=1e-6)


def test_results_go_to_other_processes(results, run_of_drop):
    again = pickle.loads(pickle.dumps(results))
    assert again.summary == results.summary and list(again.series["time"]) == list(results.series["time"])
    states = pickle.loads(pickle.dumps(results.states))
    assert states.times == results.states.times and (states[-1].grains.id == results.states[-1].grains.id).all()
    state = pickle.loads(pickle.dumps(results.states[0]))
    assert (state.grid.pressure == results.states[0].grid.pressure).all() and state.grid.cells == (12, 12, 12)
    table = pickle.loads(pickle.dumps(results.series))
    assert table.units == results.series.units
    run = pickle.loads(pickle.dumps(run_of_drop))
    assert run.folder == run_of_drop.folder and run.summary == results.summary


def test_a_run_without_results_is_not_pickled(drop):
    with pytest.raises(InputError, match="has not ended"):
        pickle.dumps(drop.start())


def test_quoted_cells_are_read(copied):
    series = copied / "series.csv"
    rows = [line.split(",") for line in series.read_text().splitlines()]
    before = sazanami.Results(copied).series
    series.write_text("".join(",".join(f'"{cell}"' for cell in row) + "\n" for row in rows))
    after = sazanami.Results(copied).series
    assert list(after) == list(before) and after.units == before.units
    assert list(after["time"]) == list(before["time"]) and list(after["limiter"]) == list(before["limiter"])


def test_pyvista(results):
    state = results.states[-1]
    try:
        import pyvista  # noqa: F401
    except ImportError:
        with pytest.raises(ImportError, match="pyvista is not installed"):
            state.to_pyvista()
    else:
        blocks = state.to_pyvista()
        assert blocks["grains"].n_points == 3
        assert blocks["water"].n_cells == 12**3
        cell = blocks["water"].find_closest_cell((3e-3, 3e-3, 4e-3))
        i, j, k = 6, 6, 8
        expected = state.grid.velocity[i, j, k]
        at = blocks["water"].find_containing_cell([a[n] for a, n in zip(state.grid.axes, (i, j, k))])
        assert blocks["water"].cell_data["velocity"][at] == pytest.approx(expected) and cell >= 0


def test_the_case_and_the_findings(results, drop):
    assert results.case.hash == drop.hash
    assert results.crater is None and results.ripples is None
    assert isinstance(results.findings, dict) and results.status == "finished"
    assert isinstance(results.observables, dict)


def refused(folder, cause):
    with pytest.raises((InputError, sazanami.CaseError), match=cause) as caught:
        results = Results(folder)
        results.series
        for state in results.states:
            state.grains
    assert caught.value.exit_code == 2


def test_folders_that_are_none(tmp_path):
    refused(tmp_path / "absent", "there is no folder")
    refused(tmp_path, "holds no results")
    for use in [sazanami.resume, sazanami.evaluate, sazanami.analyse]:
        with pytest.raises(InputError):
            use(tmp_path)


def test_folders_of_others(copied):
    summary = json.loads((copied / "summary.json").read_text())
    for change, cause in [
        ({"version": "0.0.1"}, "sazanami 0.0.1"),
        ({"status": "running"}, "broke off"),
        ({"status": None}, "no status"),
    ]:
        (copied / "summary.json").write_text(json.dumps({**summary, **change}))
        refused(copied, cause)


def test_a_run_that_goes_on(drop, tmp_path):
    run = drop.start(folder=tmp_path / "a", pictures=False, report=False)
    for _ in run.steps():
        refused(tmp_path / "a", "in use|holds no results")
        with pytest.raises(InputError, match="in use"):
            drop.run(folder=tmp_path / "a", force=True)
        break


@pytest.mark.parametrize(
    ("name", "damage", "cause"),
    [
        ("summary.json", lambda data: data[: len(data) // 2], "the summary is damaged"),
        ("series.csv", lambda data: data + b"1,2\n", "not a row"),
        ("series.csv", lambda data: b"", "this is empty"),
        ("series.csv", lambda data: data[:20], "series.csv:1: the file ends within this line"),
        ("series.csv", lambda data: data[:-1], "the file ends within this line"),
        ("case.toml", lambda data: data + b"\n= 3", "this is not TOML"),
        ("grains.pvd", lambda data: data[: len(data) // 2], "damaged"),
        ("grains/grains-*.vtp", lambda data: data[: len(data) // 2], "damaged"),
        ("grains/grains-*.vtp", lambda data: b"", "damaged"),
        ("fields/*.vti", lambda data: data[:-400] + data[-300:], "damaged"),
        ("fields/*.vti", lambda data: data.replace(b'WholeExtent="0 12', b'WholeExtent="0 13'), "damaged"),
    ],
)
def test_damaged_files(copied, name, damage, cause):
    paths = sorted(path for path in copied.glob(name) if "shape" not in path.name)
    path = paths[-1]
    path.write_bytes(damage(path.read_bytes()))
    refused(copied, cause)


def test_every_cut_of_a_file_is_refused_or_read(copied):
    path = sorted((copied / "fields").glob("*.vti"))[0]
    whole = path.read_bytes()
    for end in range(0, len(whole), max(1, len(whole) // 60)):
        path.write_bytes(whole[:end])
        with pytest.raises(InputError):
            list(Results(copied).states)
    rng = np.random.default_rng(1)
    for _ in range(60):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), 8):
            data[at] = rng.integers(0, 256)
        path.write_bytes(bytes(data))
        try:
            list(Results(copied).states)
        except (InputError, UnicodeDecodeError):
            pass


def test_a_damaged_checkpoint_is_skipped_or_refused(drop, tmp_path):
    run = drop.run(steps=3, folder=tmp_path / "a", pictures=False, report=False)
    for path in (run.folder / "checkpoints").iterdir():
        path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(InputError, match="no good checkpoint"):
        sazanami.resume(run.folder)
