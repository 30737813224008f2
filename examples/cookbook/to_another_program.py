"""The folded sheet for other programs: glTF, STL, OBJ, PLY, VTK, FOLD.

`bh export out folded.ply` does it for a run, `[outputs] folded = ["ply"]` for a scene.
"""

import meshio

import bh
import meshes
from bh.paths.export import write_state

mesh = meshes.structured(meshes.annulus_sector(radius=80, width=10, angle=0.6), along=12, rows=2)
path = bh.trace(bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2)).fold("crease", by="60deg")).require()
write_state("to_another_program.ply", [path[-1]])
found = len(meshio.read("to_another_program.ply").cells_dict["triangle"])
assert found == len(mesh.triangles), found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "to_another_program.png")
