"""Which stiffness has my crease? Fit it to the moments of a test.

Readings are made up here: 0.02 N mm / (mm rad) times the turn, with a little noise.
"""

import bh
import meshes

mesh = meshes.structured(meshes.strip(20, 20, [10]), along=4, rows=1)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.3)).crease("crease", stiffness=0.05)
for moment in (0.004, 0.008, 0.012):  # N mm / mm
    model = model.moment("crease", to=moment)
turns = bh.Measured("fold_angle", (0.21, 0.39, 0.60), of="crease", sigma=0.01)  # rad
fit = bh.calibrate(model, turns, free={"creases.crease.stiffness": (0.05, 0.001, 1.0)})
found = float(fit.values[0])
low, high = fit.intervals[0]
assert low < 0.02 < high, fit
assert abs(found - 0.02) < 0.001, found

if __name__ == "__main__":
    bh.plotting.picture(bh.trace(fit.model)[-1], "crease_from_a_test.png")
