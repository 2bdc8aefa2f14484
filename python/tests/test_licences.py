"""The licences that wheels carry are those of the crates that they are linked from."""

import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_licences_are_those_of_the_crates() -> None:
    written = (ROOT / "python/licences/third-party.txt").read_text()
    made = subprocess.run([sys.executable, ROOT / "packaging/licences"], check=True, capture_output=True, text=True).stdout
    assert made == written
    # Negative control: the list names crates, and their texts stand below.
    assert "\npyo3 " in written and "\nrayon " in written and written.count("=" * 80) > 40
