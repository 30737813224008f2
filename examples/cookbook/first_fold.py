"""Fold an annulus sector by 90 degrees, and read its energy.

The angle is imposed exactly; everything else follows. Four rows of cells a side are right to 1 %.
"""

import bh
import meshes

pattern = meshes.annulus_sector(radius="100mm", width="10mm", angle="45deg")
mesh = meshes.structured(pattern, along=24, rows=4)
model = bh.Model(mesh, bh.Sheet(E="4GPa", nu=0.38, t="0.127mm"), formulation="consistent")
path = bh.trace(model.fold("crease", by="90deg")).require()
found = path[-1].energy.total  # N mm
assert abs(found / 0.04977 - 1) < 0.005, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "first_fold.png")
