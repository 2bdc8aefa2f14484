"""Which friction gives a pile of a certain slope? A row of dry grains collapses, at two coefficients of friction.

Run it as a script, or cell by cell in an editor that knows ``# %%``. It takes less than a minute.
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
    size = ["40 mm", "5 mm", "16 mm"]
    cells = [20, 2, 8]
    [boundary]
    all = "slip"
    x2 = "periodic"
    [fluid]
    dt_max = "1 ms"
    [fluid.gas]
    density = "1.2 kg/m^3"
    kinematic_viscosity = "1.5e-5 m^2/s"
    [material.sand]
    density = "2650 kg/m^3"
    [contact.default]
    normal_stiffness = "200 N/m"
    restitution = 0.2
    friction = 0.5
    [dem]
    substeps = "auto"
    wall = "frictionless_sides"
    rolling_friction = 0.3
    [[grains]]
    name = "sand"
    shape.sphere = { diameter = "1 mm" }
    material = "sand"
    placement.lattice = { lower = ["0.05 mm", "0 mm", "0.05 mm"], upper = ["12.05 mm", "5 mm", "13.05 mm"], counts = [11, 4, 12], jitter = 0.05 }
    [heap]
    shape = "ridge"
    axis = ["0 mm", "2.5 mm"]
    [output]
    series = { every = "20 ms" }
    [run]
    until = "0.5 s"
    """
)


# %% Run it with both coefficients: the slope of the pile that falls away from the wall is in the summary of a run
angles = {}
for friction in [0.2, 0.4]:
    case = column.with_keys({"contact.default.friction": friction})
    run = case.run(folder=results / f"friction-{friction:g}", pictures=False, report=False)
    heap = run.results.observables["heap"]
    if "angle_deg" not in heap:
        print(f"friction {friction:g}: {heap['not_evaluated']}")
        continue
    angles[friction] = heap["angle_deg"]
    print(
        f"friction {friction:g}: {heap['angle_deg']:.1f} +- {heap['angle_uncertainty_deg']:.1f} degrees, "
        f"mean speed {heap['mean_speed']:.1e} m/s, {run.wall:.0f} s"
    )

# %% The friction of a pile of 20 degrees, between those that were run (spheres that roll freely lie flat)
target = 20.0
known = np.array(sorted((angle, friction) for friction, angle in angles.items()))
if not known[0, 0] <= target <= known[-1, 0]:
    raise SystemExit(f"no pile of those that were run is as steep, or as flat, as {target:g} degrees: try other coefficients")
fitted = float(np.interp(target, known[:, 0], known[:, 1]))
print(f"a friction of about {fitted:.2f} gives a slope of {target:g} degrees")
