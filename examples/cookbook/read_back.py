"""Keep a path in a file, read it back, and ask it for more.

States are computed when they are asked for; `bh.read("out")` does it for a folder of `bh run`.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=80, width=10, angle=0.6), along=12, rows=2)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2)).fold("crease", by="60deg")
path = bh.trace(model, estimate=False).require()
path.save("read_back.bh")
again = bh.read("read_back.bh").path
found = again[-1].energy.total - path[-1].energy.total
assert found == 0.0, found
assert len(again) == len(path)

if __name__ == "__main__":
    bh.plotting.fold_angles(again, "crease").savefig("read_back.svg")
