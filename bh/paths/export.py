"""Folded states and flat patterns for other programs, by the suffix of the file. mm but for glTF, which has metres."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import InputError, ModelError
from bh.formulations.stress import HEIGHT
from meshes import SheetMesh

if TYPE_CHECKING:
    from bh.formulations.state import State
    from meshes.io import FoldedFrame

FOLDED = (".fold", ".glb", ".obj", ".off", ".ply", ".stl", ".vtk", ".vtu", ".msh", ".inp")
FLAT = (".svg", ".dxf", ".fold")


def write_state(file: str | os.PathLike[str], states: Sequence[State], title: str = "sheet") -> FilePath:
    """Write the last of some states of a path; a FOLD file gets all of them as frames behind the flat key frame.

    Its energies and energy densities go with each frame, see `folded_frame`. .vtu, .vtk and .msh hold the displacement
    (mm), the energy densities (N mm / mm^2) and stresses (`cell_data`); .glb has the energy densities as colours,
    bending from none (dark) to the most there is. .obj and .glb have the flat sheet as texture coordinates.

    Args:
        file: its suffix says the format.
        states: of one path, in order; at least one.
        title: of the FOLD file.

    Returns:
        the absolute path of the file.

    Raises:
        InputError: no states, an unknown suffix, or a place that cannot be written to.
    """
    target, suffix = FilePath(file), FilePath(file).suffix.lower()
    if not states:
        raise InputError(f"there is no state to write to '{target}'; trace the model first")
    if suffix not in FOLDED:
        raise InputError(f"'{target}': suffix '{suffix}' is not known; use one of {', '.join(FOLDED)}")
    last = states[-1]
    if suffix == ".fold":
        from meshes.io import write_fold

        write_fold(
            target, last.mesh, frames=[folded_frame(state, _name(state)) for state in states], title=title
        )
    elif suffix == ".glb":
        from meshes.io import write_gltf

        write_gltf(target, last.mesh, last.points, _colours(last))
    else:
        from meshes.io import write_mesh
        from meshes.io.export import FORMATS

        nodes = {"displacement": last.points - last.mesh.points} if FORMATS[suffix][1] else {}
        cells = cell_data(last) if nodes else {}
        write_mesh(target, last.mesh, last.points, nodes, cells)
    return target.resolve()


def cell_data(state: State) -> dict[str, NDArray[np.float64]]:
    """Values of the triangles by name, for files.

    Energy densities (N mm / mm^2); where the formulation has them membrane_force (N / mm) and moment (N), components
    xx, yy, xy in the axes of the drawing, equivalent_stress_top, _middle and _bottom (MPa: von Mises, with a grain
    Hill), of laminates ply1_stress_bottom, ply1_stress_top and so on (MPa: along the fibres, across them, in shear; nan
    in zones without such a ply), and with a strength reserve, the least one through the thickness.

    Args:
        state: of a path.

    Returns:
        (t,) or (t, 3) by name.
    """
    cells = {f"{kind}_energy_density": values for kind, values in state.energy_density.items()}
    if state.recover is None or not state.mesh.flat:
        return cells
    stress = state.stress()
    cells |= {"membrane_force": stress.forces, "moment": stress.moments}
    with contextlib.suppress(ModelError):  # a grain without strengths has no equivalent stress
        cells |= {f"equivalent_stress_{side}": stress.equivalent(side) for side in HEIGHT}
    for number in range(stress.plies if stress.plies > 1 else 0):
        ply = stress.ply(number)
        cells |= {f"ply{number + 1}_stress_{side}": ply.along_fibres(side) for side in ("bottom", "top")}
    with contextlib.suppress(ModelError):
        cells["reserve"] = 1.0 / np.maximum(stress.largest(), 1e-9)
    return cells


def write_flat(file: str | os.PathLike[str], mesh: SheetMesh, facets: bool = False) -> FilePath:
    """Write the flat pattern of a mesh: .svg and .dxf have outline and creases (and `facets`), .fold the whole mesh.

    Args:
        file: its suffix says the format.
        mesh: that is flat.
        facets: draw the edges that are no creases, too.

    Raises:
        InputError: an unknown suffix, a mesh that is not flat, or a place that cannot be written to.
    """
    target, suffix = FilePath(file), FilePath(file).suffix.lower()
    if suffix not in FLAT:
        raise InputError(f"'{target}': suffix '{suffix}' is no flat pattern; use one of {', '.join(FLAT)}")
    if suffix == ".fold":
        from meshes.io import write_fold

        write_fold(target, mesh)
    else:
        from meshes.io import write_pattern

        write_pattern(target, mesh, facets=facets)
    return target.resolve()


def folded_frame(state: State, title: str) -> FoldedFrame:
    """A state as a frame of a FOLD file, with what was computed under keys of the namespace "bh".

    "bh:energies" (N mm, by kind and "total"), "bh:step" (from 1), "bh:lambda", "bh:stable" (null: not known), where the
    path ended early "bh:ended", and for each face "faces_bh:bendingEnergyDensity" and the like, N mm / mm^2.

    Args:
        state: of a path.
        title: of the frame.
    """
    from meshes.io import FoldedFrame

    results: dict[str, object] = {
        "bh:energies": state.energy.as_dict(),
        "bh:step": state.step + 1,
        "bh:lambda": state.lam,
        "bh:stable": state.stable,
        "bh:units": {
            "energies": "N mm",
            "faces_bh:...EnergyDensity": "N mm / mm^2",
            "edges_foldAngle": "degrees",
        },
    }
    if state.ended:
        results["bh:ended"] = state.ended
    results |= {f"faces_bh:{kind}EnergyDensity": values for kind, values in state.energy_density.items()}
    return FoldedFrame(title, state.points, _fold_angles(state), results)


def _name(state: State) -> str:
    return f"step {state.step + 1}, lambda {state.lam:.6g}"


def _fold_angles(state: State) -> NDArray[np.float64]:
    """(e,) fold angles of all edges, rad, mountain positive, 0 on the boundary."""
    topology = state.mesh.topology
    angles = np.zeros(len(topology.edges))
    angles[topology.hinge_edges] = np.pi - state.dihedral_angles
    return angles


def _colours(state: State) -> NDArray[np.uint8] | None:
    from matplotlib import colormaps

    values = state.nodal_energy_density("bending")
    top = float(values.max(initial=0.0))
    if top == 0.0:
        return None
    return np.asarray(np.round(255.0 * colormaps["viridis"](values / top)), dtype=np.uint8)
