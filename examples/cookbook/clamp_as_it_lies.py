"""Fold freely, clamp one end as it lies, and load the other.

`hold` keeps all directions and the slope where the nodes are; the tip moves by what the force does alone.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=100, width=10, angle=0.785), along=12, rows=4)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.38, t=0.2), formulation="consistent")
model = model.fold("crease", to="120deg").step(hold="edge:start")
model = model.force("edge:end", total=(0, 0, 0.05))
path = bh.trace(model, estimate=False).require()
ends = {state.step: state.points[mesh.nodes("edge:end"), 2].mean() for state in path}
found = ends[2] - ends[1]  # mm
assert abs(found - 4.24) < 0.01, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "clamp_as_it_lies.png")
