"""Sensitivities to every node of the flat mesh at once, by one adjoint solve for each observable.

Element data depend on the nodes of one or two triangles. Nodes are coloured so that no entry depends on two nodes of
one colour; all nodes of a colour are then moved together, and what an entry does belongs to the one that it depends on.
So the differences (of sixth order, of data only; see `bh.analysis.sensitivities`) cost some ten colours, not all nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.analysis.sensitivities import OFFSETS, STEP, Observable, data_of, derivatives_to_data, differences
from bh.analysis.situation import Situation
from bh.errors import ModelError
from bh.formulations.protocols import Data
from bh.loading.builder import load_steps
from bh.model.weight import Weight
from bh.paths.path import Path
from bh.runtime.one_line import OneLine
from bh.runtime.threads import one_blas_thread

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class NodeSensitivity(OneLine):
    """How an observable changes when nodes of the flat mesh are moved in its plane.

    Attributes:
        value: of the observable.
        gradient: (n, 2) derivatives with respect to x and y of every node, a mm.
    """

    value: float
    gradient: Array


def of_nodes(path: Path, observables: Sequence[Observable], index: int = -1) -> list[NodeSensitivity]:
    """Sensitivities of observables of a state to the places of all nodes of the stress-free flat mesh.

    The extents of edges along and across the crease (`SheetMesh.spans`), by which bars of structured meshes are
    calibrated, stay what they are. With the moves dX/dp of a parametrised pattern the chain rule gives
    sum(gradient * dX/dp).

    Args:
        path: that is solved.
        observables: as of `bh.sensitivities`.
        index: of the state.

    Returns:
        one for each observable.

    Raises:
        ModelError: a sheet that is not flat, a weight, a pinch (whose zone depends on the whole crease), or a state
            that has no sensitivities.
    """
    with one_blas_thread():
        at = Situation(path, index)
        mesh = at.model.mesh
        if not mesh.flat:
            raise ModelError("sensitivities to nodes are those of flat sheets; this one is made curved")
        if any(not np.isnan(step.pinch.toward).all() for step in load_steps(at.model)[: at.step + 1]):
            raise ModelError("a pinched zone depends on all nodes of its crease; take bh.sensitivities.of")
        if any(isinstance(item, Weight) for step in at.model.steps for item in step.actuations):
            raise ModelError("a weight depends on all nodes of a triangle; take bh.sensitivities.of")
        slopes = [(observable.value(at), observable.slope(at)) for observable in observables]
        weights = [derivatives_to_data(at, slope, value) for value, slope in slopes]
        support = at.derivatives.support()
        colour = colours(mesh.topology.hinges, mesh.triangles, len(mesh.points))
        ends = mesh.points[mesh.topology.edges]
        h = STEP * float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min())
        out = np.zeros((len(observables), len(mesh.points), 2))
        for group in range(int(colour.max()) + 1):
            for axis in range(2):
                rates = _rates(at, colour == group, axis, h)
                for j, weight in enumerate(weights):
                    _add(out[j, :, axis], weight, rates, support, colour == group)
    return [NodeSensitivity(value, gradient) for (value, _), gradient in zip(slopes, out, strict=True)]


def _rates(at: Situation, moving: NDArray[np.bool_], axis: int, h: float) -> Data:
    """Derivatives of the element data when all `moving` nodes go along an axis."""
    around = []
    for offset in OFFSETS:
        points = at.model.mesh.points.copy()
        points[moving, axis] += offset * h
        around.append(data_of(at, replace(at.model, mesh=replace(at.model.mesh, points=points))))
    return differences(around, h, at.derivatives.unfollowed)[0]


def _add(out: Array, weight: Data, rates: Data, support: dict[str, Ints], moving: NDArray[np.bool_]) -> None:
    """Add what entries contribute to the one moving node that each depends on."""
    known = np.append(moving, False)
    for key, nodes in support.items():
        if key not in weight:
            continue
        mine = known[nodes]
        node = np.where(
            mine.any(axis=-1), np.take_along_axis(nodes, mine.argmax(axis=-1)[..., None], -1)[..., 0], -1
        )
        share = weight[key] * rates[key]
        np.add.at(out, node[node >= 0], share[node >= 0])


def colours(hinges: Ints, triangles: Ints, nodes: int) -> Ints:
    """(nodes,) colours from 0, different for any two nodes of a hinge or a triangle; greedy, in the nodes' order.

    Args:
        hinges: (m, 4) node indices.
        triangles: (t, 3) node indices.
        nodes: how many there are.
    """
    import scipy.sparse as sp

    pairs = [np.column_stack((group[:, i], group[:, j])) for group in (hinges, triangles)
             for i in range(group.shape[1]) for j in range(group.shape[1]) if i != j]  # fmt: skip
    rows, columns = np.concatenate(pairs).T
    graph = sp.csr_array((np.ones(len(rows)), (rows, columns)), shape=(nodes, nodes))
    out = np.full(nodes, -1, dtype=np.int64)
    for node in range(nodes):
        taken = set(out[graph.indices[graph.indptr[node] : graph.indptr[node + 1]]].tolist())
        colour = 0
        while colour in taken:
            colour += 1
        out[node] = colour
    return out
