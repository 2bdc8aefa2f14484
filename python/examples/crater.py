"""A drop hits a bed of sand: the crater, and how it grows with the speed of the drop.

Run it as a script, or cell by cell in an editor that knows ``# %%``. It takes less than a minute.
"""

# %% Pose the case: a small box, few grains, a coarse grid
import sys
import tempfile
from pathlib import Path

import sazanami

results = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="crater-"))

case = sazanami.Case.template("raindrop")
case.set(
    {
        "domain.size": ["8 mm", "8 mm", "9 mm"],
        "domain.cells": [20, 20, 22],
        "grains.0.count": 300,
        "erosion.dr": "0.8 mm",
        "output.figures": {"at": []},
        "output.grains": {"every": "2 ms"},
        "run.until": "6 ms",
    }
)
case.liquid[0].region.sphere.diameter = "2 mm"
print(case.check().text)

# %% Pack the bed once: all runs begin from the same grains
bed = sazanami.pack(case, results / "bed")
print(f"{len(bed)} grains packed, {1e3 * bed.height:.2f} mm high")
case.grains[0].placement = {"bed": {"file": str(results / "bed" / "packed.bed")}}
# %% Run it at two speeds, and look at the fastest grain while it goes on
volumes = {}
for speed in [1.0, 4.0]:
    case.liquid[0].fall.speed = speed
    fastest = []
    run = case.run(
        folder=results / f"speed-{speed:g}",
        callback=lambda state: fastest.append((state.grains.velocity**2).sum(axis=1).max() ** 0.5),
        every="1 ms",
        pictures=False,
        report=False,
    )
    volumes[speed] = run.series["erosion_volume_excavated"][-1]
    print(f"{speed:g} m/s: {run.step} steps in {run.wall:.1f} s, fastest grains {[f'{v:.2f}' for v in fastest]} m/s")

# %% The answer
for speed, volume in volumes.items():
    print(f"{speed:g} m/s: {1e9 * volume:.3f} mm^3 lie below the surface before the impact")
slow, fast = (sazanami.Results(results / f"speed-{speed:g}") for speed in volumes)
moved = [
    abs(one.states[-1].grains.position - one.states[0].grains.position).max() for one in (slow, fast)
]
print(f"grains moved by up to {1e3 * moved[0]:.2f} and {1e3 * moved[1]:.2f} mm")
