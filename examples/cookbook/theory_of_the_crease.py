"""A crease that folds without stretching curves more: kappa = kappa_0 / sin(phi / 2).

The state's crease against the theory, in its middle, where no end disturbs it.
"""

import math

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=100, width=10, angle=1.0), along=32, rows=2)
path = bh.trace(bh.Model(mesh, bh.Sheet(E=4000, nu=0.0, t=0.05)).fold("crease", by="90deg")).require()
crease = bh.creases.along(path[-1], "crease")
found = float(crease.curvature[len(crease.curvature) // 2]) * 100.0
assert abs(found - 1 / math.sin(math.pi / 4)) < 0.01, found

if __name__ == "__main__":
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
    axes.plot(crease.curvature * 100.0)
    axes.set(xlabel="node of the crease", ylabel="curvature over that of the drawing", ylim=(0, 2))
    figure.savefig("theory_of_the_crease.svg")
