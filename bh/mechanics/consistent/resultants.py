"""Strains, curvatures, membrane forces and moments of the triangles of a sheet, in the axes of the drawing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.formulations.stress import Resultants
from bh.materials import Material
from bh.mechanics.consistent.elements import ConsistentElements
from bh.mechanics.consistent.patches import (
    curvature_maps,
    frame_angles,
    triangle_frames,
    turned_strains,
)
from bh.mechanics.consistent.sections import sheet_laws
from bh.mechanics.consistent.stretching import Pair, Stretching
from bh.model.zones import Sections
from meshes import SheetMesh

Array = NDArray[np.float64]


def resultants(
    sections: Sections,
    mesh: SheetMesh,
    elements: ConsistentElements,
    material: Material,
    x: Array,
    theta: Array,
    lam: float,
    changed: Array | None = None,
) -> Resultants:
    """What the elements measure, and what their material makes of it.

    A triangle has the mean strain of its thirds, each that of the cell of its edge, and the curvature of its angles.

    Args:
        sections: what every triangle is made of.
        mesh: the stress-free sheet, flat.
        elements: of the whole sheet.
        material: of the formulation.
        x: (n, 3) positions, mm.
        theta: (c, a) angles of the patches there, less those at rest, rad.
        lam: load parameter of the step, 0 to 1.
        changed: (t,) change of temperature or moisture.
    """
    growth = elements.growth
    at_rest = None if growth is None else growth.strains(lam)
    strain, forces = _membrane(mesh, elements.stretching, x, at_rest)
    edges, areas = triangle_frames(mesh.points, mesh.triangles)
    angle = frame_angles(mesh.points, mesh.triangles)
    patches = elements.patches
    half = np.einsum("cha,ca->ch", patches.shares, theta).reshape(*patches.members.shape, 3)
    own = np.zeros((len(areas), 3))
    own[patches.members[patches.members >= 0]] = half[patches.members >= 0]
    curvature = np.einsum("tij,tj->ti", curvature_maps(edges, areas), own)
    laws = sheet_laws(material, sections, mesh)
    moments = laws.of_triangles(np.arange(len(areas)), angle).stress(curvature)
    moments, curvature = turned_strains(moments, -angle, 1.0), turned_strains(curvature, -angle, 0.5)
    if laws.coupling is not None:
        B = np.broadcast_to(sections.each(list(laws.coupling)), (len(areas), 3, 3))
        elastic = strain if growth is None else strain - growth.mean.at(lam)
        forces = forces - np.einsum("tij,tj->ti", B, curvature)
        moments = moments - np.einsum("tij,tj->ti", B, elastic)
    if growth is not None:
        curvature = curvature + growth.curvature.at(lam)
    return Resultants(
        sections.sheets[0],
        strain,
        curvature,
        forces,
        moments,
        sections,
        changed,
    )


def _membrane(mesh: SheetMesh, stretching: Stretching, x: Array, at_rest: Pair | None) -> tuple[Array, Array]:
    """(t, 3) strains and membrane forces: of the cells, shared with the triangles by area."""
    topology = mesh.topology
    beside = topology.edge_triangles[topology.hinge_edges]
    out = np.zeros((2, len(mesh.triangles), 3))
    for number, (cells, strain, force) in enumerate(stretching.strains_and_forces(x, at_rest)):
        angle = -cells.angle(mesh.points)
        both = np.stack((turned_strains(strain, angle, 0.5), turned_strains(force, angle, 1.0)))
        sides = cells.source[:, None] if number == 0 else beside[cells.source]
        for side, share in zip(sides.T, (cells.share, 1.0 - cells.share), strict=False):
            for k in range(2):
                np.add.at(out[k], side, (share * cells.area)[:, None] * both[k])
    out /= mesh.areas[:, None]
    return out[0], out[1]
