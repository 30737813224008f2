"""Bend a folded strip over two cylinders by a third, as on a test stand.

Cylinders are rigid, without friction; `press` does the same in a scene.
"""

import math

import bh
import meshes

mesh = meshes.structured(meshes.strip(60, 20, [10]), along=12, rows=2)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.3)).fold("crease", by="60deg")
folded = bh.trace(model, estimate=False).require()
z, y = folded[-1].points[:, 2], folded[-1].points[:, 1].mean()


def cylinder(name: str, x: float, at: float, down: float = 0.0) -> bh.Indenter:
    return bh.Indenter(name, (x, y, at), math.pi / 2, 4.0, 4.0, 2.0, by=(0.0, 0.0, -down))


below, above = z.min() - 2.05, z.max() + 2.05
bars = cylinder("left", 5.0, below), cylinder("right", 55.0, below), cylinder("bar", 30.0, above, 0.5)
pressed = model.step(*bars, bh.Tether("all", (1e-3, 1e-3, 1e-3)))
path = bh.trace(pressed, after=folded, estimate=False).require()
found = -float(path[-1].contact_forces["bar"][2])  # N
assert abs(found / 0.4778 - 1) < 0.01, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "bend_a_zigzag.png")
