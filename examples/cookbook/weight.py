"""How far does a strip of card sag under its own weight?

Density comes with the material; `weight = {}` is the step of a scene.
"""

import bh
import meshes

mesh = meshes.structured(meshes.strip(100, 10, [5], "flat"), along=20, rows=1)
card = bh.Sheet(E=6000, nu=0.0, t=0.3, density=800.0)
model = bh.Model(mesh, card, formulation="consistent").support("edge:start", "xyz", clamp=True)
path = bh.trace(model.step(bh.Weight()), estimate=False).require()
found = -float(path[-1].displacement("edge:end")[:, 2].mean())  # mm
assert abs(found - 2.184) < 0.01, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "weight.png")
