"""Is the fold too sharp for the sheet? Stress over strength.

Nothing yields in the model: a utilisation above 1 says that the real sheet would.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=16, width=8, angle="60deg"), along=16, rows=4)
model = bh.Model(mesh, bh.materials.sheet("spring-steel"), formulation="consistent")
path = bh.trace(model.fold("crease", by="60deg"), estimate=False).require()
worst = path[-1].stress().worst()
found = worst.utilisation
assert abs(found - 0.678) < 0.02, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "yield_of_steel.png", "utilisation")
