"""Several steps: fold, unfold, and see that all energy comes back.

Each step begins where the one before ended; a path has the states of all.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=80, width=10, angle=0.6), along=12, rows=2)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2))
model = model.fold("crease", by="60deg").fold("crease", by="20deg").fold("crease", by="0deg")
path = bh.trace(model, estimate=False).require()
found = path[-1].energy.total / max(state.energy.total for state in path)
assert found < 1e-9, found

if __name__ == "__main__":
    bh.plotting.curves(path).savefig("there_and_back.svg")
