"""Which friction gives a pile of a certain slope? A row of dry grains collapses, at three coefficients of friction.

Run it as a script, or cell by cell in an editor that knows ``# %%``. It takes about a minute.
"""

# %% A column of spheres beside a wall, in a box that is narrow and periodic across; the air hardly matters
import sys
import tempfile
from pathlib import Path

import numpy as np
import sazanami

results = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="repose-"))

column = sazanami.Case.from_text(
    """
    title = "A dry column collapses"
    gravity = "9.81 m/s^2"
    [domain]
    size = ["40 mm", "4 mm", "16 mm"]
    cells = [20, 4, 8]
    [boundary]
    all = "slip"
    x2 = "periodic"
    [fluid]
    dt_max = "1 ms"
    [fluid.liquid]
    density = "1.2 kg/m^3"
    kinematic_viscosity = "1.5e-5 m^2/s"
    [fluid.gas]
    density = "1.2 kg/m^3"
    kinematic_viscosity = "1.5e-5 m^2/s"
    [material.sand]
    density = "2650 kg/m^3"
    [contact.default]
    normal_stiffness = "200 N/m"
    restitution = 0.5
    friction = 0.5
    [dem]
    substeps = "auto"
    [[grains]]
    name = "sand"
    shape.sphere = { diameter = "1 mm" }
    material = "sand"
    placement.lattice = { lower = ["0.05 mm", "0 mm", "0.05 mm"], upper = ["10.8 mm", "4 mm", "13.2 mm"], counts = [10, 3, 12], jitter = 0.05 }
    [output]
    series = { every = "20 ms" }
    [run]
    until = "0.3 s"
    """
)


# %% The slope of the pile: the highest grain of each slice, fitted by a line where the pile is
def slope(state, width=2e-3):
    """Angle of the surface of a pile against the horizontal [degree]."""
    x, _, z = state.grains.position.T
    slices = np.floor(x / width).astype(int)
    places = [n for n in range(slices.max() + 1) if (slices == n).sum() >= 3]
    top = np.array([z[slices == n].max() for n in places])
    middle = (np.array(places) + 0.5) * width
    pile = top > 1.2e-3
    return np.degrees(np.arctan(-np.polyfit(middle[pile], top[pile], 1)[0]))


# %% Run it with three coefficients
angles = {}
for friction in [0.05, 0.3, 0.8]:
    case = column.with_keys({"contact.default.friction": friction})
    run = case.start(folder=results / f"friction-{friction:g}", pictures=False, report=False)
    for state in run.steps(every="50 ms"):
        pass
    speed = np.sqrt((state.grains.velocity**2).sum(axis=1)).mean()
    angles[friction] = slope(state)
    print(f"friction {friction:g}: {angles[friction]:.1f} degrees, mean speed {speed:.1e} m/s, {run.wall:.0f} s")

# %% The friction of a pile of 8 degrees, between those that were run (smooth spheres that roll freely lie flat)
target = 8.0
known = np.array(sorted((angle, friction) for friction, angle in angles.items()))
if not known[0, 0] <= target <= known[-1, 0]:
    raise SystemExit(f"no pile of those that were run is as steep, or as flat, as {target:g} degrees: try other coefficients")
fitted = float(np.interp(target, known[:, 0], known[:, 1]))
print(f"a friction of about {fitted:.2f} gives a slope of {target:g} degrees")
