"""Runs: to their end, step by step, stopped, resumed."""

import os
import signal
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest
import sazanami
from conftest import DROP
from sazanami import InputError, Results


def test_a_run_ends_with_its_results(run_of_drop):
    run = run_of_drop
    assert run.status == "finished" and not run.interrupted
    assert run.time == pytest.approx(1e-3) and run.step > 1
    assert run.series["time"][-1] == pytest.approx(1e-3)
    assert run.summary["status"] == "finished"
    assert (run.folder / "report.html").is_file()
    assert run.lines and "finished" in repr(run)
    assert any("finished" in text for text in run.messages)


def test_options_that_make_no_sense_are_refused(drop, tmp_path, run_of_drop):
    for options in [
        {"until": "1 mm"},
        {"until": "-1 ms"},
        {"until": -1e-3},
        {"until": float("nan")},
        {"until": float("inf")},
        {"steps": 0},
        {"threads": 0},
        {"steps": 3, "until": 1e-3},
        {"folder": run_of_drop.folder},
        {"folder": tmp_path / "new", "ranks": 1000},
    ]:
        with pytest.raises(InputError):
            drop.run(**options)
    with pytest.raises(InputError):
        drop.run(folder=tmp_path / "never", every=0, callback=print)
    with pytest.raises(InputError):
        drop.run(folder=tmp_path / "never", every=True, callback=print)
    assert not (tmp_path / "never").exists()


def test_steps_show_states_and_change_nothing(drop, tmp_path, run_of_drop):
    run = drop.start(folder=tmp_path / "seen", threads=2, pictures=False, report=False)
    states = list(run.steps(every=np.int64(1)))
    assert [state.step for state in states] == list(range(len(states)))
    assert states[0].time == 0.0 and states[-1].time == pytest.approx(1e-3)
    assert run.summary["state_hash"] == run_of_drop.summary["state_hash"]
    first, last = states[0], states[-1]
    assert first.grains.position.shape == (3, 3) and first.grains.position.dtype == np.float64
    assert first.grains.id.tolist() == [0, 1, 2]
    # Numbers of an earlier state stay what they were.
    assert not np.array_equal(first.grains.velocity, last.grains.velocity)
    grid = last.grid
    assert grid.liquid_fraction.shape == (12, 12, 12) and grid.velocity.shape == (12, 12, 12, 3)
    # The drop is where the case puts it: axes and indices belong together.
    x, y, z = grid.axes
    c = first.grid.liquid_fraction
    weights = c / c.sum()
    centre = [
        (weights.sum(axis=(1, 2)) * x).sum(),
        (weights.sum(axis=(0, 2)) * y).sum(),
        (weights.sum(axis=(0, 1)) * z).sum(),
    ]
    assert centre == pytest.approx([3e-3, 3e-3, 4e-3], abs=1e-6)
    assert c.sum() * first.grid.cell_volume == pytest.approx(np.pi / 6 * 2e-3**3, rel=2e-3)
    assert first.grid.velocity[..., 2].min() == pytest.approx(-1.0, rel=1e-2)
    grains = first.grid.solid_fraction.sum() * first.grid.cell_volume
    assert grains == pytest.approx(3 * np.pi / 6 * 1e-3**3, rel=0.05)


def test_states_by_time_and_callback(drop, tmp_path):
    seen = []
    run = drop.run(folder=tmp_path / "a", callback=seen.append, every="0.25 ms", pictures=False, report=False)
    times = [state.time for state in seen]
    assert len(times) == 5 and times[0] == 0.0 and times[-1] == pytest.approx(1e-3)
    assert all(time >= 0.25e-3 * n * (1 - 1e-9) for n, time in enumerate(times))
    assert run.status == "finished"


def test_arrays_own_their_memory_without_copies(drop, tmp_path):
    state = next(drop.start(folder=tmp_path / "a", steps=1, pictures=False, report=False).steps())
    grid = state.grid.liquid_fraction
    assert grid.base is not None and grid.strides[0] == grid.itemsize
    assert not grid.flags.c_contiguous and grid.flags.f_contiguous
    kept = state.grains.position
    total = kept.sum()
    del state
    assert kept.sum() == total


def test_leaving_the_loop_stops_and_resume_goes_on(drop, tmp_path, run_of_drop):
    run = drop.start(folder=tmp_path / "a", pictures=False, report=False)
    for state in run.steps():
        if state.step == 3:
            break
    run.stop()
    assert run.status == "stopped" and run.interrupted and run.time < 1e-3
    with pytest.raises(InputError, match="begun already"):
        run.steps()
    again = sazanami.resume(run.folder, pictures=False, report=False)
    assert again.status == "finished"
    assert again.summary["state_hash"] == run_of_drop.summary["state_hash"]
    rest = sazanami.resume(run.folder, wait=False, pictures=False, report=False)
    assert [state.time for state in rest.steps()] == [pytest.approx(1e-3)]


def test_an_exception_in_a_callback_stops_the_run(drop, tmp_path):
    def fails(state):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        drop.run(folder=tmp_path / "a", callback=fails, pictures=False, report=False)
    assert Results(tmp_path / "a").status == "stopped"


def test_until_and_steps_stop_early(drop, tmp_path):
    short = drop.run(until="0.5 ms", folder=tmp_path / "a", pictures=False, report=False)
    assert short.status == "stopped" and not short.interrupted
    assert drop.run(steps=2, folder=tmp_path / "b", pictures=False, report=False).step == 2


def test_progress_is_heard(drop, tmp_path, capsys):
    heard = []
    drop.run(folder=tmp_path / "a", progress=heard.append, pictures=False, report=False)
    assert heard and heard[-1].phase == "flow" and 0.0 < heard[-1].fraction <= 1.0
    drop.run(folder=tmp_path / "b", progress=True, pictures=False, report=False)
    assert "flow" in capsys.readouterr().err


def test_what_progress_does_at_the_last_report_is_its_own(drop, tmp_path):
    def fails(info):
        raise ZeroDivisionError

    runs = []

    def stops(info):
        runs[0].stop()

    def interrupts(info):
        raise KeyboardInterrupt

    # One step: all is over before the first report is heard, or soon after it.
    options = {"steps": 1, "pictures": False, "report": False}
    with pytest.raises(ZeroDivisionError):
        drop.run(folder=tmp_path / "a", progress=fails, **options)
    runs.append(drop.start(folder=tmp_path / "b", progress=stops, **options))
    assert runs[0].wait().status == "stopped" and runs[0].step == 1
    # Negative control: a run that was over when progress was interrupted has nothing to go on with.
    with pytest.raises(KeyboardInterrupt):
        drop.run(folder=tmp_path / "c", progress=interrupts, **options)
    assert Results(tmp_path / "c").status == "stopped"
    drop.set({"run.until": "10 s"})
    with pytest.raises(sazanami.RunInterrupted) as caught:
        drop.run(folder=tmp_path / "d", progress=interrupts, pictures=False, report=False)
    assert sazanami.resume(caught.value.folder, steps=1, pictures=False, report=False).status == "stopped"


def test_another_thread_may_stop_a_run(drop, tmp_path):
    drop.set({"run.until": "10 s"})
    run = drop.start(folder=tmp_path / "a", threads=1, pictures=False, report=False)
    failed = []

    def stop():
        try:
            run.stop()
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=stop) for _ in range(3)]
    for state in run.steps():
        if state.step == 2:
            for thread in threads:
                thread.start()
    for thread in threads:
        thread.join()
    assert not failed and run.status == "stopped" and run.interrupted and run.folder == tmp_path / "a"
    # Told again: nothing takes it away.
    assert run._core.wait(0.0)[0] == "ended" and run.wait().status == "stopped"


def test_a_failure_is_told_again(drop, tmp_path, run_of_drop):
    run = drop.start(folder=run_of_drop.folder, pictures=False, report=False)
    for _ in range(2):
        with pytest.raises(InputError, match="empty|results"):
            run.wait()


def test_ranks_and_threads_give_the_same_bits(drop, tmp_path, run_of_drop):
    run = drop.run(folder=tmp_path / "a", threads=2, pictures=False, report=False)
    assert run.summary["state_hash"] == run_of_drop.summary["state_hash"]
    two = drop.start(folder=tmp_path / "b", ranks=2, threads=1, pictures=False, report=False)
    last = list(two.steps(every="1 ms"))[-1]
    assert last.grains.count == 3 and last.grid.cells == (12, 12, 12)


def test_the_interpreter_goes_on_while_a_run_does(drop, tmp_path):
    counted, over = [0], threading.Event()

    def count():
        while not over.is_set():
            counted[0] += 1
            over.wait(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    case = drop.with_keys({"domain.cells": [32, 32, 32]})
    run = case.run(folder=tmp_path / "a", threads=1, pictures=False, report=False)
    over.set()
    thread.join()
    assert counted[0] > 100 * run.wall


def test_a_run_that_fails_says_where_and_when(drop, tmp_path):
    # Grains that lie in one another.
    drop.set({"grains.0.placement.list": [{"position": [3e-3, 3e-3, 1e-3]}, {"position": [3.1e-3, 3e-3, 1e-3]}]})
    with pytest.raises(sazanami.SazanamiError) as caught:
        drop.run(folder=tmp_path / "a", pictures=False, report=False)
    assert isinstance(caught.value, (sazanami.CaseError, sazanami.RunFailed))
    lost = sazanami.Case.from_text(DROP.replace('"1e3 N/m"', '"1e-3 N/m"').replace('speed = "1 m/s"', 'speed = "30 m/s"'))
    lost.set({"dem.substeps": 1, "run.until": "20 ms"})
    with pytest.raises((sazanami.RunFailed, sazanami.CaseError)) as caught:
        lost.run(folder=tmp_path / "b", pictures=False, report=False)
    if isinstance(caught.value, sazanami.RunFailed):
        assert caught.value.kind and caught.value.message and caught.value.step >= 0
        assert Results(tmp_path / "b").status == "failed"


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_writes_a_checkpoint(tmp_path):
    (tmp_path / "drop.toml").write_text(DROP)
    script = textwrap.dedent(
        f"""
        import signal
        import sazanami
        # Who starts the tests in the background has them ignore Ctrl-C, and so their children.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        case = sazanami.Case.from_file({str(tmp_path / "drop.toml")!r})
        case.set({{"run.until": "10 s", "output": {{"series": {{"steps": 1}}}}}})
        try:
            case.run(folder={str(tmp_path / "a")!r}, threads=1, pictures=False, report=False,
                     callback=lambda state: print("going", flush=True), every=20)
        except sazanami.RunInterrupted as interrupted:
            print("interrupted", interrupted.folder, flush=True)
            raise SystemExit(7)
        """
    )
    # Not in the folder of the sources, which would be taken for the package.
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    assert process.stdout.readline() == "going\n"
    os.kill(process.pid, signal.SIGINT)
    out, _ = process.communicate(timeout=120)
    assert process.returncode == 7 and "interrupted" in out
    results = Results(tmp_path / "a")
    assert results.status == "stopped"
    again = sazanami.resume(tmp_path / "a", steps=2, pictures=False, report=False)
    assert again.step == results.summary["steps"] + 2


def test_a_run_that_nobody_keeps_ends(drop, tmp_path):
    run = drop.start(folder=tmp_path / "a", pictures=False, report=False)
    states = run.steps()
    next(states)
    del states, run
    assert Results(tmp_path / "a").status == "stopped"
