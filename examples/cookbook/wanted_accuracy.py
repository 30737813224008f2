"""Ask for an accuracy in place of a mesh: the result brings its error.

Meshes are refined until the estimate holds; in a scene it is the line `accuracy = 0.05`.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=80, width=10, angle=0.6), along=8)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2)).fold("crease", by="60deg")
path = bh.trace(model, accuracy=0.05).require()
found = path.accuracy.estimate  # relative, of the energy
assert path.accuracy.met
assert found < 0.05, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "wanted_accuracy.png")
