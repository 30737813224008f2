"""Several creases, mountain and valley in turn.

`all` folds every crease the way that it is drawn.
"""

import bh
import meshes

pattern = meshes.annulus_sector([60, 70, 80], 10, 0.7, ["mountain", "valley", "mountain"])
mesh = meshes.structured(pattern, along=16, rows=4)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.15), formulation="consistent")
path = bh.trace(model.fold("all", by="75deg"), estimate=False).require()
found = path[-1].energy.total
assert abs(found / 0.1191 - 1) < 0.01, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "pleats.png")
