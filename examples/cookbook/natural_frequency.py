"""The lowest frequency of a clamped strip of steel, against the beam.

The same for a folded sheet: give a path that ends in its folded state.
"""

import math

import bh
import meshes

mesh = meshes.structured(meshes.strip(80, 8, [4], "flat"), along=24, rows=1)
model = bh.Model(mesh, bh.Sheet(E=193000, nu=0.0, t=0.1)).support("edge:start", "xyz", clamp=True)
path = bh.trace(model.force("edge:end", total=(0, 0, 1e-6)), estimate=False).require()
mode = bh.stiffness_probe.Probe(path).modes(1, density=7900.0)[0]
found = mode.frequency  # Hz
beam = 1.8751**2 / (2 * math.pi * 0.08**2) * math.sqrt(193e9 * 1e-4**2 / (12 * 7900))
assert abs(found / beam - 1) < 0.01, found

if __name__ == "__main__":
    from matplotlib import pyplot as plt

    axes = plt.figure().add_subplot(projection="3d")
    axes.plot_trisurf(*(mesh.points + 10 * mode.shape).T, triangles=mesh.triangles)
    axes.figure.savefig("natural_frequency.png", dpi=60)
