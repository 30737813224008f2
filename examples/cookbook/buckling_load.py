"""Does it buckle? The load of a pressed strip, against Euler.

Linearised: exact where the sheet stays straight until it buckles, a first guess where it bends before.
"""

import math

import bh
import meshes

mesh = meshes.structured(meshes.strip(60, 10, [5], "flat"), along=24, rows=1)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.0, t=0.3))
model = model.support("edge:start", "xyz").support("edge:end", "yz")
(mode,) = bh.buckling.buckling_modes(bh.Path(model), bh.Force("edge:end", total=(-1.0, 0, 0)), count=1)
found = mode.factor  # times 1 N
euler = math.pi**2 * 4000 * 10 * 0.3**3 / 12 / 60**2
assert abs(found / euler - 1) < 0.01, found

if __name__ == "__main__":
    from matplotlib import pyplot as plt

    axes = plt.figure().add_subplot(projection="3d")
    axes.plot_trisurf(*(mesh.points + 5 * mode.shape).T, triangles=mesh.triangles)
    axes.figure.savefig("buckling_load.png", dpi=60)
