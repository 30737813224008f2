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
STRUCTURED = """[mesh]                           # along the rulings
kind = "staggered"               # right for bars and hinges
aspect_ratio = 8.0               # of the cells, best 5 to 12; or along = 64, the number of cells along a crease
"""
GMSH = """[mesh]                           # creases that meet, cross or end inside the sheet
kind = "gmsh"
size = {size:.3g}                       # of the triangles, mm
"""
DRAWN = """[mesh]                           # the drawing has facet lines (rulings): its own faces are the mesh
kind = "drawn"
"""
REST = """[sheet]
E = 4000.0                       # Young's modulus, MPa (paper: 3000 to 5000)
nu = 0.3                         # Poisson's ratio; bars and hinges take 0
t = 0.2                          # thickness, mm

{mesh}
[model]
# "bars-and-hinges" is fast, on rulings; "consistent" is right on every mesh; "shell" judges both
formulation = "{formulation}"

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

[outputs]                        # beside path.bh and result.json
pictures = true
# folded = ["glb", "obj", "stl"]
# flat = ["dxf", "svg"]          # for the laser cutter
"""


def example(drawing: Path | None = None, folder: Path = Path()) -> str:
    """The text of a scene; with a drawing (looked for in `folder`) the mesh that suits what it shows.

    Raises:
        InputError: the drawing cannot be read, or is none.
    """
    head = "# A scene: `bh check` draws it, `bh run` folds it. mm, N, rad; docs/scenes.md has every key.\n\n"
    if drawing is None:
        rest = REST.format(mesh=STRUCTURED, formulation="bars-and-hinges", place="corner:inner-start")
        return f"{head}{LIBRARY}\n{rest}"
    if drawing.suffix.lower() not in (".svg", ".dxf"):
        raise InputError(f"'{drawing}' is no drawing; give an .svg or .dxf file")
    from meshes.io import read_pattern

    pattern = read_pattern(folder / drawing)
    name = '"' + str(drawing).replace("\\", "/").replace('"', '\\"') + '"'
    if pattern.rails:
        mesh, formulation = STRUCTURED, "bars-and-hinges"
    elif pattern.facets:
        mesh, formulation = DRAWN, "consistent"
    else:
        side = max(
            float(pattern.rings[0][:, axis].max() - pattern.rings[0][:, axis].min()) for axis in (0, 1)
        )
        mesh, formulation = GMSH.format(size=side / 25.0), "consistent"
    place = f"edge:{pattern.edges[0][0]}"
    return (
        f"{head}{DRAWING.format(file=name)}\n{REST.format(mesh=mesh, formulation=formulation, place=place)}"
    )
