"""Compile (or load from the cache) the kernels of every formulation: `python -m bh.commands.warm_up`.

A first run then does not wait; kernels of contact, of presses and of laws of the sheet are compiled when they are used.
"""

from __future__ import annotations

import math

import meshes
from bh.analysis.contact import candidates
from bh.analysis.projection import meets_itself, outline
from bh.analysis.triangles import intersecting
from bh.commands.compile_ahead import compiled_ahead
from bh.formulations.registry import names
from bh.model.model import Model
from bh.model.sheet import Sheet
from bh.paths.path import Path
from bh.solvers.linear import linear_response
from bh.solving.trace import trace


def warm_up() -> None:
    """Fold a tiny sheet in every way that has kernels of its own, in every formulation that is installed."""
    mesh = meshes.structured(meshes.annulus_sector(10.0, 1.0, 0.3), along=2)
    for name in names():
        path = _fold(Model(mesh, Sheet(E=1.0, t=0.1), formulation=name))
    clamped = Model(mesh, Sheet(E=1.0, t=0.1), formulation="consistent").support(
        "edge:start", "xyz", clamp=True
    )
    trace(clamped.fold("crease", rest=3.0, Lstar=1.0))
    x = path[-1].points
    intersecting(x, mesh.triangles, candidates(x, mesh.triangles), 1e-9)
    meets_itself(x, mesh.triangles, outline(mesh.triangles), 1e-9)
    wide = meshes.structured(meshes.annulus_sector(10.0, 5.0, 1.0), along=64, rows=20)  # too wide for a band
    system = Path(Model(wide, Sheet(E=1.0, t=0.1)).fold("crease", rest=3.0, Lstar=1.0)).system(0)
    now = system.evaluate(system.start(), 0.0)
    matrix = system.tangent(system.start(), 0.0, now.forces).matrix
    matrix @ matrix.factorise().solve(now.residual)


def _fold(sheet: Model) -> Path:
    path = trace(sheet.fold("crease", to=math.pi - 0.1))
    trace(
        sheet.support("edge:start", "xyz")
        .support("edge:end", [[0.0, 1.0, 1.0]])
        .fold("crease", rest=3.0, Lstar=1.0)
    )
    system = path.system(0)
    linear_response(system, path.records[0].q)
    displaced = (
        sheet.support("edge:start", "xyz").support("edge:inner", "z").displace("corner:outer-end", "z", 0.01)
    )
    system = trace(displaced).system(0)
    system.control_rate(system.start(), 0.0)
    return path


if __name__ == "__main__":
    with compiled_ahead():
        warm_up()
    print("kernels are compiled and cached")
