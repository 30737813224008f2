"""All components of the shell in one vector, prescribed ones included, and what an element sees of them.

Displacements of all nodes in local axes (mm), r rotations alpha an edge and r fold angles beta a creased edge (rad).
r = 2 with quadratic positions: values at the lower and the higher node; r = 1 with linear positions: constant. An
element of n nodes sees 3 n displacements, 3 r alpha and 3 r beta (-1 where its edge is not creased), and works with its
positions and the rotations gamma = +-alpha + beta / 2 of its side of its edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.constraints import Constraints
from bh.model.ramp import Ramp
from fem.creases import Connectors
from fem.shell import ShellElements
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Components:
    """Numbering of one step; k components of which n are free.

    Attributes:
        reference: (n, 3) nodes of the flat sheet, mm.
        nodes: (t, n) nodes of every element.
        constraints: supports, with the axes of oblique ones.
        begin: (k,) values in the state that the step begins with, mm and rad.
        prescribed: values at lambda, where they are prescribed.
        free: (n,) components that are unknowns.
        number: (k,) unknown of each component, -1 if prescribed.
        of_element: (t, 3 n + 6 r) see the module.
        sides: (t, 3 r) +-1 of alpha in gamma.
        first_alpha: where rotations begin.
        first_beta: where fold angles begin.
        rotations: r, of an edge.
    """

    reference: Array
    nodes: Ints
    constraints: Constraints
    begin: Array
    prescribed: Ramp
    free: Ints
    number: Ints
    of_element: Ints
    sides: Array
    first_alpha: int
    first_beta: int
    rotations: int

    @property
    def rate(self) -> Array:
        """(k,) rates of prescribed components by lambda, zero elsewhere."""
        out = self.prescribed.rate
        out[self.free] = 0.0
        return out

    def whole(self, q: Array, lam: float) -> Array:
        """(k,) all components from the unknowns (n,).

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        out = self.prescribed.at(lam)
        out[self.free] = q
        return out

    def alpha(self, components: Array) -> Array:
        """(e, r) rotations of edges relative to the frames of the step."""
        return components[self.first_alpha : self.first_beta].reshape(-1, self.rotations)

    def beta(self, components: Array) -> Array:
        """(c, r) fold angles of creased edges."""
        return components[self.first_beta :].reshape(-1, self.rotations)

    def moves(self, components: Array) -> Array:
        """(n, 3) displacements in global axes, mm."""
        return self.to_global(components[: self.first_alpha].reshape(-1, 3))

    def to_global(self, local: Array) -> Array:
        """(n, 3) nodal vectors in global axes from those in the local axes of oblique supports."""
        turned = np.flatnonzero(self.constraints.frame_of >= 0)
        if len(turned) == 0:
            return local
        axes = self.constraints.frames[self.constraints.frame_of[turned]]
        out = local.copy()
        out[turned] = np.einsum("nij,ni->nj", axes, local[turned])
        return out

    def to_local(self, vectors: Array) -> Array:
        """(n, 3) nodal vectors in the local axes of oblique supports from those in global axes."""
        return local_axes(self.constraints, vectors)

    @property
    def turns_of_element(self) -> tuple[Ints, Ints]:
        """(t, 3 r) components alpha and beta of every element."""
        first, size = 3 * self.nodes.shape[1], 3 * self.rotations
        return self.of_element[:, first : first + size], self.of_element[:, first + size :]

    def gather(self, components: Array) -> Array:
        """(t, 3 n + 3 r) displacements in global axes and side rotations of every element."""
        moves = self.moves(components)[self.nodes].reshape(len(self.nodes), -1)
        alpha, beta = self.turns_of_element
        gamma = components[alpha] * self.sides + 0.5 * np.where(beta >= 0, components[beta], 0.0)
        return np.hstack((moves, gamma))

    def spread(self, element: Array) -> Array:
        """(k,) element vectors (t, 3 n + 3 r) added up: the transposed of `gather`."""
        moves = 3 * self.nodes.shape[1]
        x = np.empty_like(self.reference)
        for axis in range(3):
            pull = element[:, axis:moves:3].ravel()
            x[:, axis] = np.bincount(self.nodes.ravel(), pull, minlength=len(x))
        alpha, beta = self.turns_of_element
        used = beta >= 0
        rows = np.concatenate((alpha.ravel(), beta[used]))
        values = np.concatenate(((element[:, moves:] * self.sides).ravel(), 0.5 * element[:, moves:][used]))
        out: Array = np.bincount(rows, values, minlength=len(self.number)).astype(float)
        out[: self.first_alpha] = self.to_local(x).ravel()
        return out


def local_axes(constraints: Constraints, vectors: Array) -> Array:
    """Nodal vectors (n, 3) in the local axes of oblique supports.

    Args:
        constraints: with the axes.
        vectors: (n, 3) in global axes.
    """
    turned = np.flatnonzero(constraints.frame_of >= 0)
    if len(turned) == 0:
        return vectors
    out = vectors.copy()
    axes = constraints.frames[constraints.frame_of[turned]]
    out[turned] = np.einsum("nij,nj->ni", axes, vectors[turned])
    return out


def lay_out(
    elements: ShellElements,
    constraints: Constraints,
    creases: Connectors,
    positions: Array,
    beta: Array,
    clamped: Ints,
) -> Components:
    """Number the components of a step.

    Args:
        elements: of the sheet.
        constraints: supports and prescribed displacements.
        creases: creased edges, of which imposed angles are prescribed.
        positions: (n, 3) of all nodes where the step begins, mm.
        beta: (m, r) fold angles of all hinges there, rad.
        clamped: edges whose rotation is zero.

    Raises:
        ModelError: nothing is free.
    """
    mesh = elements.mesh
    nodes, edges = len(mesh.nodes), len(elements.lengths)
    turns = elements.tables.rotations
    still = np.zeros((edges, turns), dtype=bool)
    still[clamped] = True
    fixed = np.concatenate((constraints.fixed.ravel(), still.ravel(), np.repeat(creases.prescribed, turns)))
    none = np.zeros(turns * edges)
    displacement = local_axes(constraints, positions - mesh.nodes).ravel()
    begin = np.concatenate((displacement, none, beta[creases.hinges].ravel()))
    given = np.concatenate((constraints.start.ravel(), none, creases.angle.start.ravel()))
    end = np.concatenate((constraints.end.ravel(), none, creases.angle.end.ravel()))
    free = np.flatnonzero(~fixed)
    if not (free < 3 * nodes).any():
        raise ModelError("the supports hold every node; nothing can move, so remove some of them")
    number = np.full(len(fixed), -1, dtype=np.int64)
    number[free] = np.arange(len(free))
    return Components(
        reference=mesh.nodes,
        nodes=mesh.triangles,
        constraints=constraints,
        begin=begin,
        # a displacement whose start is not given begins with what the node has
        prescribed=Ramp(np.where(np.isnan(given), begin, given), end),
        free=free,
        number=number,
        of_element=_of_element(elements, creases),
        sides=np.repeat(elements.loops.sides, turns, axis=1),
        first_alpha=3 * nodes,
        first_beta=3 * nodes + turns * edges,
        rotations=turns,
    )


def _of_element(elements: ShellElements, creases: Connectors) -> Ints:
    """(t, 3 n + 6 r) components of every element; the two ends of edge j are corners j + 1 and j + 2."""
    nodes, edges, sides = elements.mesh.triangles, elements.loops.edges, elements.loops.sides
    turns = elements.tables.rotations
    x = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
    first = 3 * len(elements.mesh.nodes)
    # of two values on an edge: is this end its higher node
    which = (
        np.stack((sides < 0, sides > 0), axis=-1) if turns == 2 else np.zeros((*sides.shape, 1), dtype=int)
    )
    alpha = first + turns * edges[:, :, None] + which
    crease = creases.of_edge[edges][:, :, None]
    beta = np.where(crease >= 0, first + turns * len(creases.of_edge) + turns * crease + which, -1)
    size = 3 * turns
    return np.hstack((x, alpha.reshape(-1, size), beta.reshape(-1, size))).astype(np.int64)


def edge_set(mesh: SheetMesh, name: str) -> Ints:
    """Numbers of the edges of a named set.

    Args:
        mesh: has the set.
        name: of the set.

    Returns:
        (k,) numbers, in the order of the set.

    Raises:
        MeshError: an edge of the set is none of the mesh.
        ModelError: there is no such set; the message lists those there are.
    """
    if name not in mesh.edge_sets:
        raise ModelError(f"the sheet has no edge set '{name}'; use one of {', '.join(mesh.edge_sets)}")
    return mesh.topology.find_edges(mesh.edge_sets[name])
