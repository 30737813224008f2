"""L* of a crease from a measured curve: the sheet is lifted in three steps, with the force read after each.

Nobody measured here: the curve is the shell's, with 3 % of noise, and what is fitted to it is the consistent
formulation. The interval is that of the noise; the difference of the two models on these meshes comes on top.
"""

import matplotlib.pyplot as plt
import numpy as np

import bh
import meshes

pattern = meshes.annulus_sector(radius=60, width=12, angle=0.8)


def lifted(formulation: str, along: int, rows: int, lstar: float) -> bh.Model:
    """The sheet with its edges kept in the plane and its crease lifted in three steps."""
    mesh = meshes.structured(pattern, along=along, rows=rows)
    model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.38, t=0.2), formulation=formulation)
    model = model.crease("crease", Lstar=lstar).support("corner:inner-start", "xyz")
    model = model.support("corner:outer-start", "yz").support("edge:inner", "z").support("edge:outer", "z")
    for lift in (0.8, 1.6, 2.4):
        model = model.step(bh.Displace("crease:crease", "z", by=lift))
    return model


path = bh.trace(lifted("shell", 16, 2, lstar=20.0), estimate=False).require()
ends = {state.step: state for state in path}
true = np.array([ends[step].reaction("crease:crease")[2] for step in sorted(ends)])
noise = 0.03 * float(true.max())
measured = true + noise * np.random.default_rng(1).normal(size=3)
data = bh.Measured("reaction_z", measured.tolist(), of="crease:crease", sigma=noise)
found = bh.calibrate(
    lifted("consistent", 24, 4, lstar=50.0), data, {"creases.crease.Lstar": (50.0, 2.0, 200.0)}
)
print(f"{found}, where the shell had 20; {found.solved} solutions")


fitted = bh.trace(found.model, estimate=False)
stiff, soft = (bh.trace(lifted("consistent", 24, 4, lstar), estimate=False) for lstar in (10.0, 50.0))
figure, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
axes.errorbar((0.8, 1.6, 2.4), measured, 1.96 * noise, fmt="o", capsize=3, label="measured, 95 %")
for curve, name in ((fitted, "fitted"), (stiff, "L* = 10 mm"), (soft, "L* = 50 mm")):
    ends = {state.step: state.reaction("crease:crease")[2] for state in curve}
    axes.plot((0.0, 0.8, 1.6, 2.4), [0.0, *(ends[step] for step in sorted(ends))], label=name)
axes.set(xlabel="lift of the crease, mm", ylabel="force, N")
axes.legend()
figure.savefig("calibrate_crease.png", dpi=120)
