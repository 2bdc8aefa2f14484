"""A shaken tank: water over a bed of spheres, and what the ripple analysis says of its surface.

Run it as a script, or cell by cell in an editor that knows ``# %%``. It takes less than a minute.
"""

# %% A short and narrow tank of the template
import sys
import tempfile
from pathlib import Path

import numpy as np
import sazanami

results = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="tank-"))

case = sazanami.Case.template("shaken_tank")
case.set(
    {
        "domain.lower": ["-20 mm", "0 mm", "0 mm"],
        "domain.size": ["40 mm", "8 mm", "16 mm"],
        "liquid.0.region.box": {"lower": ["-20 mm", "0 mm", "0 mm"], "upper": ["20 mm", "8 mm", "8 mm"]},
        "grains.0.placement.packed": {"level": "3 mm", "glued": "0.75 mm", "fall_gravity": 4.0},
        "frame.motion.amplitude": ["-3 mm", "0 mm", "0 mm"],
        "frame.motion.frequency": "5 Hz",
        "ripples.layer_thickness": "1.5 mm",
        "ripples.margin": "3 mm",
        "probe.0.gauge": ["15 mm", "4 mm"],
        "output": {
            "series": {"every": "0.01 s"},
            "fields": {"every": "0.1 s"},
            "grains": {"every": "0.1 s"},
            "figures": {"at": []},
        },
        "run.until": "0.2 s",
    }
)
check = case.check()
print(f"{check.report['particles']['fluid']} particles of water, {check.report['grains']} grains")

# %% Run it; the water surface is seen as it goes on
sloshing = []
for state in case.start(folder=results / "tank", pictures=False, report=False).steps(every="20 ms"):
    x, _, z = state.particles.position.T
    ends = [z[x < -16e-3].max(), z[x > 16e-3].max()]
    sloshing.append((state.time, ends[1] - ends[0]))
sloshing = np.array(sloshing)
print(f"the water stands up to {1e3 * np.abs(sloshing[:, 1]).max():.1f} mm higher at one end than at the other")

# %% The bed: its surface in the table, ripples in the summary, evaluated again with another margin
tank = sazanami.Results(results / "tank")
bed = tank.table("bed.csv")
print("columns of the bed:", ", ".join(bed))


def said(ripples):
    """Ripples, or why there are none yet: a bed takes many periods to grow them."""
    return ripples["crested"].get("none") or f"{ripples['crested']['wavelength_mm']:.1f} mm apart"


print("ripples:", said(tank.ripples))
print(f"relief of the bed: {tank.ripples['relief_mm']:.2f} mm")
again = sazanami.evaluate(results / "tank", {"ripples.margin": "6 mm"})
print("with a margin of 6 mm:", said(again["ripples"]), f"relief {again['ripples']['relief_mm']:.2f} mm")
