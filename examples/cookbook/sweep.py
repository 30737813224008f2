"""A table of energies for several angles, in one call.

`bh sweep` does it for thousands of points on many machines; this is the same in one process.
"""

from pathlib import Path

import bh.sweep

scene = Path(__file__).parent.parent / "appendix_b_a.toml"
task = bh.sweep.scene(scene, {"angle": "steps[0].fold.to"})
Path("sweep.nc").unlink(missing_ok=True)
data = bh.sweep.run(task, bh.sweep.grid({"angle": [2.4, 2.0, 1.6]}), "sweep.nc", pool=0)
energies = data["energy_total"]
found = float(energies.sel(angle=1.6) / energies.sel(angle=2.4))
assert abs(found - 6.47) < 0.01, found

if __name__ == "__main__":
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
    axes.plot(data["angle"], energies, "o-")
    axes.set(xlabel="dihedral angle, rad", ylabel="energy, N mm")
    figure.savefig("sweep.svg")
