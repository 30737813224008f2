"""Supports and dead forces of a model on the nodes of the shell's elements."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.loading.builder import load_steps
from bh.loading.load_step import LoadStep, StepEnd
from bh.model.actuations import Displace, Fold, Force
from bh.model.constraints import Constraints
from bh.model.growth import Expand
from bh.model.loads import AreaForce, LineForce
from bh.model.model import Model
from bh.model.ramp import Ramp
from bh.model.springs import ground_stiffness
from bh.model.step import Actuation
from bh.model.supports import select
from bh.model.weight import Weight
from fem.components import edge_set
from fem.shell import ShellElements
from meshes.curved import ElementMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
LATE = (Force, Displace, Weight, LineForce, AreaForce)
WEIGHT = "the weight"  # no set of edges is called that


@dataclass(frozen=True)
class EdgeMoments:
    """Couples on boundary edges, which a model of bars and hinges cannot say.

    Attributes:
        at: edge set, and couple a length, N, at the start and at the end of the step; positive raises the
            outside of the boundary edge toward the sheet's normal.
    """

    at: tuple[tuple[str, float, float], ...] = ()


def constraints(mesh: ElementMesh, model: Model, step: int, points: Array | None = None) -> Constraints:
    """Supports and prescribed displacements in step `step` on all nodes, middle nodes of named edges included.

    A support of listed nodes holds just these corners.

    Args:
        mesh: elements.
        model: has supports and steps.
        step: number of the step.
        points: (n, 3) of all nodes where it begins, mm; None for the flat sheet.
    """
    steps = tuple(
        replace(each, actuations=tuple(_plain(item) for item in each.actuations))
        for each in model.steps[: step + 1]
    )
    ends = {}
    if points is not None and any(each.looks_back for each in steps):
        ends = {step - 1: StepEnd(1.0, points, np.zeros(0))}
    return load_steps(replace(model, mesh=mesh.linear, steps=steps, zones=()), ends)[step].constraints


def ground(elements: ShellElements, model: Model) -> Array | None:
    """(n, 3) stiffness of the springs to the ground at all nodes along x, y and z, N / mm; None without springs.

    Those of an area or of a place as a whole are shared by middle nodes too; those of each node are of corners only.

    Args:
        elements: of the sheet.
        model: has the springs.
    """
    mesh = elements.mesh
    if not model.springs:
        return None
    out = ground_stiffness([item for item in model.springs if item.total is not None], mesh.linear)
    corners = [item for item in model.springs if item.each is not None]
    out[: len(mesh.sheet.points)] += ground_stiffness(corners, mesh.sheet)
    rows = mesh.triangles[:, 3:] if mesh.degree == 2 else mesh.triangles  # as a force an area acts on them
    area = np.bincount(rows.ravel(), np.repeat(elements.areas / 3.0, 3), minlength=len(out))
    for item in model.springs:
        if item.per_area is not None:
            nodes = select(mesh.linear, item.at)
            out[nodes] += area[nodes, None] * np.asarray(item.per_area)
    return out


def _plain(item: Actuation) -> Actuation:
    """Fold angles an edge do not fit the halved edges, and do not matter here."""
    if isinstance(item, Expand):  # it holds nothing
        return Expand()
    if not isinstance(item, Fold):
        return item
    if item.to is not None and not isinstance(item.to, float):
        return replace(item, to=float(np.mean(item.to)))
    if item.by is not None and not isinstance(item.by, float | str):
        return replace(item, by=float(np.mean(item.by)))
    if item.rest is not None and not isinstance(item.rest, float):
        return replace(item, rest=float(np.mean(item.rest)))
    return item


def forces(elements: ShellElements, model: Model, step: int, acting: Ramp) -> Ramp:
    """Dead forces (n, 3) on all nodes, N, at the start and the end of step `step`.

    They are those of `acting` (corners, 3), what the steps ask for, but that a `total` on a named set of edges is a
    uniform line load a length of edge instead of equal shares, and that of a weight every node has its own part.

    Args:
        elements: of the sheet.
        model: has the steps.
        step: number of the step.
        acting: (corners, 3) forces that the steps ask for, N.

    Raises:
        ModelError: a total on a named set that is no set of edges.
    """
    for each in model.steps[
        :step
    ]:  # which part of a line load acted where such a step ended is not known here
        if each.until is not None and any(isinstance(item, LATE) for item in each.actuations):
            raise ModelError(
                "the shell cannot go on after a force, weight or displacement that `until` ended early"
            )
    mesh, lengths = elements.mesh, elements.lengths
    lines: dict[str, Array] = {}
    before: dict[str, Array] = {}
    for each in model.steps[: step + 1]:
        before = dict(lines)
        for item in each.actuations:
            if isinstance(item, Force) and isinstance(item.at, str) and item.at in mesh.sheet.edge_sets:
                lines[item.at] = _line(mesh, item, lengths)
            elif isinstance(item, Weight):
                lines[WEIGHT] = _spread(elements, item.of_triangles(model.sections), None)
            elif isinstance(item, AreaForce):
                force = np.asarray(item.per_area, dtype=float)
                lines[item.key] = _spread(elements, force, item.on(mesh.sheet))
            elif isinstance(item, LineForce):
                lines[item.key] = _along(mesh, item, lengths)

    def whole(corners: Array, instead: dict[str, Array]) -> Array:
        out = np.zeros_like(mesh.nodes)
        out[: len(corners)] = corners
        return sum(instead.values(), out)

    return Ramp(whole(acting.start, before), whole(acting.end, lines))


def _spread(elements: ShellElements, force: Array, triangles: Ints | None) -> Array:
    """(n, 3) what is different where a force an area acts on quadratic triangles, not on their corners alone, N."""
    mesh = elements.mesh
    out = np.zeros_like(mesh.nodes)
    if mesh.degree == 1:
        return out
    rows = slice(None) if triangles is None else triangles
    each = np.broadcast_to(force, (len(mesh.triangles), 3))[rows]
    for nodes, areas in (
        (mesh.triangles[:, 3:], elements.areas),
        (mesh.sheet.triangles, -mesh.sheet.areas),
    ):
        np.add.at(out, nodes[rows], (areas[rows] / 3.0)[:, None, None] * each[:, None])
    return out


def _along(mesh: ElementMesh, item: LineForce, lengths: Array) -> Array:
    """(n, 3) what is different where a force a length acts on curved edges with a middle, N."""
    out = np.zeros_like(mesh.nodes)
    edges = mesh.sheet.topology.find_edges(mesh.sheet.edge_sets[item.at])
    ends = mesh.sheet.topology.edges[edges]
    force = np.asarray(item.per_length, dtype=float)
    chords = np.linalg.norm(mesh.sheet.points[ends[:, 1]] - mesh.sheet.points[ends[:, 0]], axis=1)
    rule = [(ends[:, k], -0.5 * chords) for k in range(2)]
    if mesh.degree == 2:
        rule += [(ends[:, k], lengths[edges] / 6.0) for k in range(2)]
        rule.append((len(mesh.sheet.points) + edges, lengths[edges] * (2.0 / 3.0)))  # Simpson's
    else:
        rule += [(ends[:, k], 0.5 * lengths[edges]) for k in range(2)]
    for rows, length in rule:
        np.add.at(out, rows, length[:, None] * force)
    return out


def _line(mesh: ElementMesh, item: Force, lengths: Array) -> Array:
    """(n, 3) what is different where a total force is a line load, N."""
    out = np.zeros_like(mesh.nodes)
    if item.total is None:
        return out
    assert isinstance(item.at, str)
    total = np.asarray(item.total, dtype=float)
    edges = mesh.sheet.topology.find_edges(mesh.sheet.edge_sets[item.at])
    share = lengths[edges] / lengths[edges].sum()
    ends = mesh.sheet.topology.edges[edges]
    middle = len(mesh.sheet.points) + edges
    rule: tuple[tuple[Ints, float], ...] = ((ends[:, 0], 0.5), (ends[:, 1], 0.5))
    if mesh.degree == 2:
        rule = ((ends[:, 0], 1.0 / 6.0), (ends[:, 1], 1.0 / 6.0), (middle, 2.0 / 3.0))  # Simpson's
    for rows, part in rule:
        np.add.at(out, rows, part * share[:, None] * total)
    nodes = select(mesh.sheet, item.at)
    out[nodes] -= total / len(nodes)
    return out


def edge_moments(elements: ShellElements, moments: EdgeMoments, load_step: LoadStep | None = None) -> Ramp:
    """(e, r) couples on the rotations alpha of edges, N mm / rad.

    Args:
        elements: of the sheet.
        moments: on named sets of boundary edges, N.
        load_step: whose couples on edges act besides, or None.

    Raises:
        ModelError: a set that does not exist, or edges inside the sheet.
    """
    sheet = elements.mesh.sheet
    turns = elements.tables.rotations
    out = np.zeros((2, len(elements.lengths), turns))
    side = np.zeros(len(elements.lengths))
    side[elements.loops.edges] = elements.loops.sides
    for name, *couple in moments.at:
        chosen = edge_set(sheet, name)
        if (sheet.topology.edge_triangles[chosen, 1] >= 0).any():
            raise ModelError(f"edge moments act on boundary edges; '{name}' lies inside")
        out[:, chosen] += np.reshape(couple, (2, 1, 1)) / turns * (side * elements.lengths)[chosen, None]
    if load_step is not None and load_step.edge_couple is not None:
        ends = np.stack((load_step.edge_couple.start, load_step.edge_couple.end))
        out += (ends / turns * side * elements.lengths)[..., None]
    return Ramp(out[0], out[1])
