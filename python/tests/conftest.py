"""Cases that run in seconds, and one run that several tests read."""

import pytest
import sazanami

DROP = """\
name = "drop"
[domain]
size = ["6 mm", "6 mm", "6 mm"]
cells = [12, 12, 12]
[fluid.liquid]
density = "1000 kg/m^3"
kinematic_viscosity = "1e-6 m^2/s"
[[liquid]]
name = "drop"
region.sphere = { diameter = "2 mm" }
position = ["3 mm", "3 mm", "4 mm"]
fall = { speed = "1 m/s" }
[material.sand]
density = "2650 kg/m^3"
[contact."sand/sand"]
normal_stiffness = "1e3 N/m"
restitution = 0.5
friction = 0.6
[[grains]]
name = "sand"
shape.sphere = { diameter = "1 mm" }
material = "sand"
placement.list = [
  { position = ["1.5 mm", "3 mm", "0.6 mm"] },
  { position = ["3 mm", "3 mm", "0.6 mm"] },
  { position = ["4.5 mm", "3 mm", "0.6 mm"] },
]
[output]
series = { steps = 1 }
fields = { every = "0.5 ms" }
grains = { every = "0.25 ms" }
[run]
until = "1 ms"
"""


@pytest.fixture
def drop():
    return sazanami.Case.from_text(DROP, "drop.toml")


@pytest.fixture(scope="session")
def run_of_drop(tmp_path_factory):
    case = sazanami.Case.from_text(DROP, "drop.toml")
    return case.run(folder=tmp_path_factory.mktemp("results") / "drop", threads=1, pictures=False)
