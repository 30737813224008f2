"""How stiff is a folded sheet where it is held, and in which direction?

A probe of a solved state has the stiffness of nodes or edges in every direction, from one factorisation.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=100, width=10, angle=0.785), along=24, rows=4)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.38, t=0.2), formulation="consistent").fold("crease", to=2.1)
path = bh.trace(model, estimate=False).require()
tip = bh.stiffness_probe.Probe(path, hold="edge:start").at("corner:outer-end")
found = float(tip.loaded((0, 0, 1)))  # N/mm
assert abs(found / 0.00838 - 1) < 0.01, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "stiffness_of_an_edge.png")
