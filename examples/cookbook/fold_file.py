"""A FOLD file of somebody else: its faces are the mesh.

Bars and hinges by name: the faces of a Miura sheet are not made for a shell.
"""

from pathlib import Path

import bh

scene = bh.load_scene(Path(__file__).parent.parent / "miura.toml")
path = bh.trace(scene.model).require()
found = path[-1].energy.total
assert scene.model.formulation == "bars-and-hinges"
assert abs(found - 0.2093) < 1e-3, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "fold_file.png")
