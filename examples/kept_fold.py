"""A crease that yields: folded by couples and let go, card keeps a part of its fold; a cycle draws its hysteresis.

    python examples/kept_fold.py

A straight strip and a curved sector of the same card, with the same elastic-plastic crease, are folded by a couple,
let go, folded the other way, let go and folded once more. The straight hinge keeps (M - M_y) / H, as the closed form
has it; the panels of the curved one take a part of the couple, so it yields less, and they push it open again. The
picture shows both held (grey) and let go (blue), and the couple against the fold.
"""

from __future__ import annotations

import math

import matplotlib as mpl

import bh
import meshes

mpl.use("Agg")
import matplotlib.pyplot as plt

K, YIELD, HARDENING = 0.3, 0.1, 0.03  # N mm / (mm rad), N mm / mm, N mm / (mm rad)
COUPLES = [0.13, 0.0, -0.13, 0.0, 0.13]  # N mm / mm, one a step
SHEETS = {
    "straight": meshes.structured(meshes.strip(length=50.0, width=20.0, creases=[10.0]), along=12, rows=2),
    "curved": meshes.structured(meshes.annulus_sector(radius=50.0, width=10.0, angle=1.0), along=24, rows=2),
}

figure = plt.figure(figsize=(11.0, 3.8))
chart = figure.add_subplot(1, 3, 3)
print(f"a hinge alone keeps {math.degrees((COUPLES[0] - YIELD) / HARDENING):.1f} degrees")
for column, (name, mesh) in enumerate(SHEETS.items()):
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.3, t=0.4))
    model = model.crease("crease", stiffness=K, law=bh.ElasticPlastic(YIELD, HARDENING))
    for couple in COUPLES:
        model = model.moment("crease", to=couple)
    path = bh.trace(model, estimate=False).require()
    ends = {state.step: state for state in path}
    held, free = ends[0], ends[1]
    loop = ends[4].energy.dissipated - ends[0].energy.dissipated
    folds = [math.degrees(float(state.fold_angle("crease").mean())) for state in (held, free)]
    print(
        f"{name}: folds to {folds[0]:.1f} degrees, keeps {folds[1]:.1f}; a cycle dissipates {loop:.2f} N mm"
    )

    axes = figure.add_subplot(1, 3, column + 1, projection="3d", elev=25.0, azim=-60.0)
    for state, colour in ((held, "0.75"), (free, "tab:blue")):
        points = state.points - state.crease_points("crease").mean(axis=0)
        axes.plot_trisurf(*points.T, triangles=mesh.triangles, color=colour, edgecolor="none", alpha=0.9)
    axes.set_title(f"{name}: held {folds[0]:.0f}°, let go {folds[1]:.0f}°", fontsize=10)
    axes.set_aspect("equal")
    axes.set_axis_off()
    turns = [math.degrees(float(state.fold_angle("crease").mean())) for state in path]
    before = [0.0, *COUPLES]
    applied = [(1.0 - s.lam) * before[s.step] + s.lam * before[s.step + 1] for s in path]
    chart.plot(turns, applied, ".-", label=name)
chart.set(xlabel="fold, degrees", ylabel="couple, N mm / mm")
chart.axhline(0.0, color="0.85", lw=0.8, zorder=0)
chart.legend()
figure.tight_layout()
figure.savefig("kept_fold.png", dpi=120)
