"""Solve one sheet by every formulation and compare.

`bh compare scene.toml` does the same for a scene, with a picture of the differences.
"""

import bh
import meshes
from bh.applications.comparison import compare, lines, picture

mesh = meshes.structured(meshes.annulus_sector(radius=80, width=10, angle=0.6), along=16, rows=2)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2)).fold("crease", by="60deg")
comparison = compare(model, formulations=("consistent", "shell"))
print("\n".join(lines(comparison)))
one, shell = comparison.members
found = one.path[-1].energy.total / shell.path[-1].energy.total
assert abs(found - 1.0) < 0.05, found

if __name__ == "__main__":
    picture(comparison).savefig("compare_models.svg")
