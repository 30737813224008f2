"""The commented scene that `bh init` writes, for a pattern of the library or for a drawing."""

from __future__ import annotations

from pathlib import Path

from bh.errors import InputError

LIBRARY = """[pattern]
kind = "annulus_sector"          # a pattern of the library; or file = "sheet.svg", .dxf or .fold
radius = [60.0, 75.0, 90.0]      # of the creases, mm
width = 15.0                     # of the panels inside the first and outside the last crease, mm
angle = 1.2                      # of the sector, rad
fold = ["mountain", "valley", "mountain"]
"""
DRAWING = """[pattern]
file = {file}
# fit = 200.0                    # the longer side of the sheet in mm, where the drawing has no units of its own
# gap = 0.5                      # lines that miss each other by up to so much are joined, mm
# lines = {{ "#00aa00" = "valley", "layer:score" = "mountain" }}   # what lines stand for, in front of the defaults
"""
ACCURACY = """\
# Mesh and formulation are chosen, and refined until the energy is right to 5 % by its own estimate. To choose a mesh
# put [mesh] in its place: kind = "staggered", along = 64, rows = 4; or kind = "gmsh", size = 4.0 (docs/scenes.md).
accuracy = 0.05
"""
REST = """[sheet]
E = 4000.0                       # Young's modulus, MPa (paper: 3000 to 5000)
nu = 0.3                         # Poisson's ratio; bars and hinges take 0
t = 0.2                          # thickness, mm

# Without supports the sheet is free: rigid motions are taken out, nothing is held. To hold something:
# [[supports]]
# at = "{place}"                 # a place, or a list of nodes; `bh check` draws and lists the places
# fix = "xyz"

[[steps]]
# Springs: every crease wants to fold by 0.8 rad, the way it is drawn, and the sheet finds its balance with them.
# Lstar (mm) is the length scale of a crease: the smaller, the stiffer.
fold = {{ crease = "all", by = 0.8, Lstar = 25.0 }}
# Exactly so, where the angles can all be had at once (a single curved crease, parallel ones):
# fold = {{ crease = "all", by = 0.8 }}

# [[steps]]                      # steps run one after another
# force = {{ at = "{place}", total = [0.0, 0.0, 0.01] }}      # N

# Panels stop each other from where they meet. To let them pass (above the first table): contact = false.

[outputs]                        # beside path.bh and result.json
pictures = true
# folded = ["glb", "obj", "stl"]
# flat = ["dxf", "svg"]          # for the laser cutter
"""


def example(drawing: Path | None = None, folder: Path = Path()) -> str:
    """The text of a scene; with a drawing (looked for in `folder`) that is to be folded.

    Args:
        drawing: file name of a drawing (.svg, .dxf, .cp, .opx) or of a .fold file; None for a scene without one.
        folder: where the drawing is looked for.

    Raises:
        InputError: the drawing cannot be read, or is none.
    """
    head = "# A scene: `bh check` draws it, `bh run` folds it. mm, N, rad; docs/scenes.md has every key.\n\n"
    if drawing is None:
        return f"{head}{ACCURACY}\n{LIBRARY}\n{REST.format(place='corner:inner-start')}"
    from meshes.io import read_pattern
    from meshes.io.drawing import PATTERNS

    if drawing.suffix.lower() not in PATTERNS:
        raise InputError(f"'{drawing}' is no drawing; give a file that ends in one of {', '.join(PATTERNS)}")

    pattern = read_pattern(folder / drawing)
    name = '"' + str(drawing).replace("\\", "/").replace('"', '\\"') + '"'
    rest = REST.format(place=f"edge:{pattern.edges[0][0]}")
    return f"{head}{ACCURACY}\n{DRAWING.format(file=name)}\n{rest}"
