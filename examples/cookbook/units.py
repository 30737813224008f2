"""Type quantities as they were measured: inches, degrees, GPa.

A plain number is mm, N, MPa, rad; a text with a unit is taken wherever a quantity stands.
"""

import math

import bh
import meshes

mesh = meshes.structured(meshes.strip("4in", "1in", ["0.5in"]), along=12, rows=2)
sheet = bh.Sheet(E="580ksi", nu=0.3, t="0.2mm")
path = bh.trace(bh.Model(mesh, sheet).fold("crease", by="60deg")).require()
found = math.degrees(path[-1].fold_angle("crease").mean())
assert abs(found - 60.0) < 1e-9, found
assert abs(sheet.E - 3999.0) < 1.0
assert abs(mesh.points[:, 0].max() - 101.6) < 1e-12

if __name__ == "__main__":
    bh.plotting.pattern(path.model).savefig("units.svg")
