"""The examples run, and what they print makes sense."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import sazanami

EXAMPLES = Path(__file__).parent.parent / "examples"


def printed(name, folder):
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py"), str(folder)], capture_output=True, text=True, timeout=1200
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_crater(tmp_path):
    text = printed("crater", tmp_path)
    slow, fast = (float(found) for found in re.findall(r"m/s: ([-\d.]+) mm\^3", text))
    assert fast > 2.0 * abs(slow)
    results = sazanami.Results(tmp_path / "speed-4")
    assert results.crater is not None
    before = results.crater
    again = sazanami.evaluate(results.folder, {"erosion.dr": "1 mm"})["erosion"]
    # Other layers find another crater, and leave that of the run alone.
    assert again != before and sazanami.Results(results.folder).crater == before
    with pytest.raises(sazanami.CaseError, match="cannot be changed afterwards"):
        sazanami.evaluate(results.folder, {"run.until": 1.0})


def test_repose_angle(tmp_path):
    text = printed("repose_angle", tmp_path)
    angles = [float(found) for found in re.findall(r"friction [\d.]+: ([-\d.]+) \+- [\d.]+ degrees", text)]
    assert len(angles) == 2 and 0.0 < angles[0] < 20.0 < angles[1] < 45.0
    assert 0.2 < float(re.search(r"friction of about ([\d.]+)", text)[1]) < 0.4


def test_shaken_tank(tmp_path):
    text = printed("shaken_tank", tmp_path)
    assert float(re.search(r"up to ([\d.]+) mm higher", text)[1]) > 0.5
    tank = sazanami.Results(tmp_path / "tank")
    assert tank.ripples is not None and tank.states[-1].particles.position.shape[1] == 3
    assert tank.table("bed.csv").rows > 0
