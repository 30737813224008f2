"""End a step where something is reached: here at a stored energy.

Observables are energies, fold angles, reactions, displacements, the depth, or a function of one's own.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=80, width=10, angle=0.6), along=12, rows=2)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2))
model = model.fold("crease", by="90deg", until=bh.Until("energy", 0.05))
path = bh.trace(model, estimate=False).require()
found = path[-1].energy.total
assert abs(found - 0.05) < 1e-6, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "stop_at_a_value.png")
