"""Pinch the middle of a folded crease nearly closed: the energy that it takes.

A pinch closes a part of a crease that is folded already; `pinch = { crease = "crease", ... }` in a scene.
"""

import math

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=100, width=5, angle=0.6), along=48, rows=4)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.0, t=0.5), formulation="consistent")
model = model.fold("crease", by="60deg").pinch("crease", to="100deg", length=20.0)
path = bh.trace(model, estimate=False).require()
ends = {state.step: state.energy.total for state in path}
found = ends[1] / ends[0]
assert abs(found - 5.935) < 0.02, found
assert abs(math.degrees(math.pi - path[-1].fold_angle("crease").max()) - 100.0) < 0.5

if __name__ == "__main__":
    bh.plotting.fold_angles(path, "crease").savefig("pinch.svg")
