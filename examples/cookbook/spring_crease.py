"""A crease is a spring: the sheet does not let it come to its rest angle.

L* says how soft it is: 0.5 mm is a stiff crease of polyester, 200 mm an unusually soft one.
"""

import math

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=100, width=10, angle=0.785), along=24, rows=4)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.38, t=0.127), formulation="consistent")
path = bh.trace(model.fold("crease", rest=math.pi / 2, Lstar=25.0)).require()
found = math.degrees(path[-1].fold_angle("crease").mean())  # of 90
assert abs(found - 87.5) < 0.1, found

if __name__ == "__main__":
    bh.plotting.fold_angles(path, "crease").savefig("spring_crease.svg")
