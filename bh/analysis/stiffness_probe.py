"""Stiffness of a solved state: in any direction at a place, condensed to any components, and its lowest modes.

The tangent of the state is factorised once; everything is read from its responses to unit forces at the probed
components (the compliance C), so a whole sphere of directions costs three solves. Rotations at edges and the moments of
prescribed creases follow (static condensation); supports and prescribed displacements stay. What is probed may be
a body that is free to move: its rigid motions cost nothing, exactly.

Two stiffnesses in a direction n belong to the 3 x 3 matrix K of a place (source 3.5.1: K = F / Delta, the force along
the displacement over the displacement):

- `Stiffness.guided(n)` = n.K.n: the place moves along n and not across it; F is the component along n.
- `Stiffness.loaded(n)` = 1 / (n.K^-1.n): a force along n, and the place moves across as it likes; in a stable state
  never more than the other.

Lengths mm, forces N, stiffness N/mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis.modes import Mode, Response, lowest
from bh.errors import ModelError
from bh.model.supports import directions, select
from bh.paths.path import Path
from bh.runtime.one_line import OneLine
from bh.runtime.threads import one_blas_thread
from bh.solvers.factor import Factor, IndefiniteError, Matrix
from bh.solvers.matrices import FreeBodyMatrix
from bh.solvers.saddle import MultiplierMatrix
from meshes.topology import Ints

Array = NDArray[np.float64]
Place = str | Sequence[int]
FREE = 1e-13  # stiffness of a motion, in parts of a typical one, that is rounding
SHIFT = 1e-12  # in parts of the diagonal, where a pivot vanishes
MECHANISMS = 8  # most that are looked for besides rigid motions
REFINED = 2
NONE = 1e-12  # principal stiffnesses below this part of the largest are none
RANK = 1e-9  # singular values below this part of the largest are zero
TONNE = 1e-12  # kg / m^3 in t / mm^3, which goes with N, mm and s


@dataclass(frozen=True, eq=False, repr=False)
class Stiffness(OneLine):
    """Stiffness of a place against translation.

    Attributes:
        matrix: (3, 3) forces (N) for unit translations (mm), symmetric; zero along `fixed`.
        fixed: (3, h) orthonormal directions along which supports fix the place: infinitely stiff.
    """

    matrix: Array
    fixed: Array

    def guided(self, direction: ArrayLike) -> Array:
        """n.K.n (...,) for directions n (..., 3) of any length: the place moves along n only, N/mm; inf where fixed.

        Returns:
            of the shape of `direction` without its last axis.
        """
        n = _units(direction)
        out = np.einsum("...i,ij,...j->...", n, self.matrix, n)
        return np.where(self._fixed_share(n) > RANK, np.inf, out)

    def loaded(self, direction: ArrayLike) -> Array:
        """1 / (n.K^-1.n) (...,) for directions n (..., 3): a force along n, free to move across, N/mm; inf where fixed.

        Zero where the force meets a motion that costs nothing.

        Returns:
            of the shape of `direction` without its last axis.
        """
        n = _units(direction)
        values, vectors = np.linalg.eigh(self.matrix)
        along = (n @ vectors) ** 2
        kept = 1.0 - np.einsum("ik,ik->k", self.fixed.T @ vectors, self.fixed.T @ vectors) > 0.5
        largest = np.abs(values).max()
        zero = kept & (np.abs(values) <= NONE * largest)
        firm = kept & ~zero
        compliance = (along[..., firm] / values[firm]).sum(axis=-1)
        with np.errstate(divide="ignore"):
            out = np.where(np.abs(compliance) > 0.0, 1.0 / compliance, np.inf)
        # what is left of n in fixed directions only
        out = np.where(along[..., firm | zero].sum(axis=-1) <= RANK**2, np.inf, out)
        return np.where(along[..., zero].sum(axis=-1) > RANK, 0.0, out)

    def _fixed_share(self, n: Array) -> Array:
        return np.asarray(((n @ self.fixed) ** 2).sum(axis=-1))

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Principal stiffnesses (3,), rising, and their directions (3, 3) in columns; fixed ones are last and inf."""
        values, vectors = np.linalg.eigh(self.matrix)
        share = self._fixed_share(vectors.T) > 0.5
        values = np.where(share, np.inf, values)
        order = np.argsort(values)
        return values[order], vectors[:, order]


class Probe:
    """The tangent of one state of a path, factorised once.

    Args:
        path: a solved path, of any formulation.
        index: of the state; the last one by default.
        hold: places whose nodes are fixed in all directions while probing, besides the supports; slopes stay free there
            (`hold` of a step clamps them).

    Raises:
        ModelError: there is no such state, or it has more motions without stiffness than can be told apart.
    """

    def __init__(self, path: Path, index: int = -1, hold: Place | Sequence[Place] = ()) -> None:
        """Factorise the tangent of a state.

        Args:
            path: solved.
            index: of the state.
            hold: places that are fixed besides the supports.
        """
        if not isinstance(path, Path):
            raise ModelError(
                f"a probe takes a solved path, not a {type(path).__name__}; give bh.trace(model)"
            )
        if not -len(path) <= index < len(path):
            raise ModelError(f"the path has {len(path)} states, none of index {index}; give one that it has")
        self.system, record = path.solved(index)
        self.mesh = path.model.mesh
        self.thickness = path.model.sheet.t
        self.q, self.lam = record.q, record.lam
        self.points: Array = self.system.positions(self.q, self.lam)
        self._fixed = self._places(hold)
        with one_blas_thread():
            forces = self.system.evaluate(self.q, self.lam).forces
            self.matrix: Matrix = self.system.tangent(self.q, self.lam, forces).matrix
            try:
                self._factor: Factor = self.matrix.factorise_any()[0]
            except IndefiniteError:
                # a pivot vanished: a mechanism; what the shift changes is taken out by refinement
                self._factor = self._shifted()
            self._rigid = self._rigid_body()
            self._rigid = np.column_stack((self._rigid, self._mechanisms()))

    def _shifted(self) -> Factor:
        try:
            return self.matrix.factorise(SHIFT)
        except IndefiniteError:
            raise ModelError(
                "the tangent of this state is singular and cannot be factorised; probe a state beside it"
            ) from None

    # ------------------------------------------------------------------------------- stiffness

    def at(self, place: Place, turning: bool = True) -> Stiffness:
        """Stiffness of a node, or of nodes that move together as a rigid body, against translation.

        Args:
            place: its name or node indices.
            turning: several nodes turn as they like, about their mean position (False: they only translate).

        Raises:
            ModelError: one of several nodes is fixed by a support.
        """
        nodes = select(self.mesh, place)
        if len(nodes) == 1:
            node = int(nodes[0])
            free, fixed = self._axes(node)
            block = self._condensed([(node, axis) for axis in free])
            return Stiffness(free.T @ block @ free, fixed.T)
        block = self._condensed(self._components([(nodes.tolist(), "xyz")]))
        shift = np.tile(np.eye(3), (len(nodes), 1))
        K = shift.T @ block @ shift
        if turning:
            arm = self.points[nodes] - self.points[nodes].mean(axis=0)
            cross = np.cross(np.eye(3)[None, :, :], arm[:, None, :])  # of the unit rotations
            turns = cross.transpose(0, 2, 1).reshape(-1, 3) / max(float(np.abs(arm).max()), 1e-300)
            left, sizes, _ = np.linalg.svd(turns, full_matrices=False)
            # nodes on a line do not feel a turn about it
            turns = left[:, sizes > RANK * sizes.max(initial=0.0)]
            mixed = shift.T @ block @ turns
            K = K - mixed @ np.linalg.pinv(turns.T @ block @ turns, rcond=1e-12, hermitian=True) @ mixed.T
        return Stiffness(0.5 * (K + K.T), np.zeros((3, 0)))

    def reduced(self, *parts: tuple[Place, str | Sequence[Sequence[float]]]) -> Array:
        """(m, m) stiffness condensed to components of nodes, N/mm; all other unknowns follow.

        Args:
            parts: pairs of a place and directions (letters out of "xyz", or vectors). Components are in the order of
                the parts, in each node by node, for each node in the order of the directions.

        Raises:
            ModelError: a component is fixed, or named twice.
        """
        if not parts:
            raise ModelError(
                "reduced stiffness of nothing; give places and directions, such as ('node:3', 'xz')"
            )
        return self._condensed(self._components(parts))

    def against(self, loads: ArrayLike) -> Array:
        """(m, m) stiffness condensed to m generalised displacements: those that nodal loads (m, n, 3) do work on.

        A load of unit size asks for the mean displacement that it is conjugate to; a point between nodes is a load that
        they share. N/mm.

        Args:
            loads: (m, n, 3) nodal loads.

        Raises:
            ModelError: loads that do not fit, or that do no work.
        """
        rows = np.asarray(loads, dtype=float)
        if rows.ndim != 3 or rows.shape[1:] != self.points.shape or not np.isfinite(rows).all():
            raise ModelError(f"loads must be finite arrays (m, {len(self.points)}, 3), not {rows.shape}")
        return self._against(np.column_stack([self.system.loads(row) for row in rows]))

    # ------------------------------------------------------------------------------- modes

    def modes(self, count: int = 6, density: float | None = None) -> tuple[Mode, ...]:
        """The lowest modes, by the size of their eigenvalues; free motions come first.

        Args:
            count: how many.
            density: kg / m^3. Masses are lumped: each node has a third of the triangles around it. None for
                the modes of the stiffness alone.

        Returns:
            the modes in order.

        Raises:
            ModelError: a count or density that cannot be.
        """
        if density is not None and not (math.isfinite(density) and density > 0.0):
            raise ModelError(f"density = {density} cannot be; give a positive number in kg / m^3")
        H = self._fixed_columns
        everywhere = self.system.loads(np.ones_like(self.points))
        most = int(np.count_nonzero(everywhere)) - H.shape[1]
        if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or not 1 <= count <= most:
            raise ModelError(f"count = {count} modes cannot be; give a whole number from 1 to {most}")
        root = np.ones(len(self.points))
        if density is not None:
            root = np.sqrt(TONNE * density * self.thickness * self._nodal_areas())

        def weigh(u: Array) -> Array:
            return self.system.loads(root[:, None] * self.system.vectors(u))

        def describe(u: Array) -> str:
            return self.system.describe(self.q, self.lam, u)

        with one_blas_thread():
            response = Response(self._solve, H, self._rigid)
            found = lowest(response, lambda u: self.matrix @ u, weigh, count, self._typical(weigh))
        return tuple(
            Mode(value, self.system.vectors(u), describe(u), free, _frequency(value, free, density))
            for value, u, free in found
        )

    def _nodal_areas(self) -> Array:
        out = np.zeros(len(self.points))
        np.add.at(out, self.mesh.triangles.ravel(), np.repeat(self.mesh.areas / 3.0, 3))
        return out

    def _typical(self, weigh: Callable[[Array], Array]) -> float:
        """Size of the eigenvalues of a rough motion."""
        u = self.system.loads(np.random.default_rng(3).normal(size=self.points.shape))
        w = weigh(u)
        return float(np.linalg.norm(self.matrix @ u) * np.linalg.norm(u) / (w @ w))

    # ------------------------------------------------------------------------------- condensation

    def _condensed(self, components: list[tuple[int, Array]]) -> Array:
        """(m, m) least energy for given displacements of components; fixed nodes among all others stay."""
        clash = {node for node, _ in components} & set(self._fixed.tolist())
        if clash:
            raise ModelError(f"node {min(clash)} is fixed while it is probed; leave it out of one of them")
        if not components:
            return np.zeros((0, 0))
        return self._against(self._columns(components))

    def _against(self, columns: Array) -> Array:
        """(m, m) stiffness against unit loads (size, m); fixed nodes stay."""
        B, m = np.column_stack((columns, self._fixed_columns)), columns.shape[1]
        with one_blas_thread():
            C = B.T @ self._solve(B)
        C = 0.5 * (C + C.T)
        basis = np.eye(B.shape[1])
        if self._rigid.shape[1]:
            # motions that cost nothing: only forces in equilibrium with each other resist
            left, sizes, _ = np.linalg.svd(B.T @ self._rigid)
            basis = left[:, int((sizes > RANK).sum()) :]
        K = np.zeros_like(C)
        if basis.shape[1]:
            try:
                K = basis @ np.linalg.solve(basis.T @ C @ basis, basis.T)
            except np.linalg.LinAlgError:
                raise ModelError("two of the components are the same; give each once") from None
        K = K[:m, :m]
        return np.asarray(0.5 * (K + K.T))

    def _components(
        self, parts: Sequence[tuple[Place, str | Sequence[Sequence[float]]]]
    ) -> list[tuple[int, Array]]:
        found = []
        seen: dict[int, list[Array]] = {}
        for place, fix in parts:
            axes = directions(fix)
            for node in select(self.mesh, place).tolist():
                fixed = self._axes(node)[1]
                for axis in axes:
                    if np.abs(fixed @ axis).max(initial=0.0) > RANK:
                        raise ModelError(
                            f"node {node} is fixed along {_letters(axis)} by a support or a prescribed displacement; "
                            "leave it out"
                        )
                    seen.setdefault(node, []).append(axis)
                    if np.linalg.matrix_rank(np.array(seen[node]), tol=RANK) < len(seen[node]):
                        raise ModelError(
                            f"node {node} is named twice along {_letters(axis)}; give each component once"
                        )
                    found.append((node, axis))
        return found

    def _axes(self, node: int) -> tuple[Array, Array]:
        """(f, 3) and (h, 3) orthonormal directions in which a node is free and fixed."""
        forces = np.zeros_like(self.points)
        rows = []
        for axis in np.eye(3):
            forces[node] = axis
            rows.append(self.system.vectors(self.system.loads(forces))[node])
        values, vectors = np.linalg.eigh(np.array(rows))
        return vectors.T[values > 0.5], vectors.T[values <= 0.5]

    def _columns(self, components: Sequence[tuple[int, Array]]) -> Array:
        """(size, m) unit forces along components."""
        out = np.zeros((len(self.q), len(components)))
        forces = np.zeros_like(self.points)
        for k, (node, axis) in enumerate(components):
            forces[node] = axis
            out[:, k] = self.system.loads(forces)
            forces[node] = 0.0
        return out

    def _solve(self, B: Array) -> Array:
        """Responses (size, m) to loads in equilibrium, refined: multipliers are found by iteration."""
        out = np.empty_like(B)
        for k in range(B.shape[1]):
            load = self._balanced(B[:, k])
            x = self._balanced(self._factor.solve(load))
            for _ in range(REFINED):
                x = x + self._balanced(self._factor.solve(self._balanced(load - self.matrix @ x)))
            out[:, k] = x
        return out

    def _balanced(self, b: Array) -> Array:
        """Without the part along motions that cost nothing."""
        return np.asarray(b - self._rigid @ (self._rigid.T @ b))

    @cached_property
    def _fixed_columns(self) -> Array:
        return self._columns([(int(n), axis) for n in self._fixed for axis in self._axes(int(n))[0]])

    def _rigid_body(self) -> Array:
        """(size, r) orthonormal rigid motions that the supports leave."""
        inner = self.matrix.augmented if isinstance(self.matrix, MultiplierMatrix) else self.matrix
        if not isinstance(inner, FreeBodyMatrix):
            return np.zeros((len(self.q), 0))
        return np.vstack((inner.Z, np.zeros((len(self.q) - len(inner.Z), inner.Z.shape[1]))))

    def _mechanisms(self) -> Array:
        """(size, k) further orthonormal motions whose stiffness is rounding, by inverse iteration on a few vectors."""
        primal = self.system.primal
        rng = np.random.default_rng(20)
        rough = np.concatenate((rng.normal(size=primal), np.zeros(len(self.q) - primal)))
        limit = FREE * float(np.linalg.norm((self.matrix @ rough)[:primal]) / np.linalg.norm(rough))
        for block in (1, MECHANISMS):
            X = np.zeros((len(self.q), min(block, primal)))
            X[:primal] = rng.normal(size=(primal, X.shape[1]))
            for _ in range(4):
                X = np.column_stack([self._factor.solve(x) for x in X.T])
                X[primal:] = 0.0
                X = np.linalg.qr(X)[0]
            ritz = X.T @ np.column_stack([self.matrix @ x for x in X.T])
            values, turn = np.linalg.eigh(0.5 * (ritz + ritz.T))
            free = np.abs(values) <= limit
            if not free.any():
                return np.zeros((len(self.q), 0))
        if free.all():
            named = self.system.describe(self.q, self.lam, X @ turn[:, 0])
            raise ModelError(
                f"this state has too many motions without stiffness, such as: {named}; add supports"
            )
        return np.asarray(X @ turn[:, free])

    def _places(self, hold: Place | Sequence[Place]) -> Ints:
        if isinstance(hold, str):
            return select(self.mesh, hold)
        if len(hold) == 0:
            return np.zeros(0, dtype=np.int64)
        if all(isinstance(item, (int, np.integer)) for item in hold):
            return select(self.mesh, hold)  # type: ignore[arg-type]
        return np.unique(np.concatenate([select(self.mesh, item) for item in hold]))  # type: ignore[arg-type]


def sphere(theta: ArrayLike, phi: ArrayLike) -> Array:
    """(..., 3) unit vectors of azimuths theta (from the x axis) and polar angles phi (from the z axis), rad (3.5.1).

    Args:
        theta: azimuths, rad.
        phi: polar angles, rad.

    Returns:
        broadcast from both.
    """
    theta, phi = np.asarray(theta, dtype=float), np.asarray(phi, dtype=float)
    sine = np.sin(phi)
    return np.stack(np.broadcast_arrays(sine * np.cos(theta), sine * np.sin(theta), np.cos(phi)), axis=-1)


def _units(direction: ArrayLike) -> Array:
    n = np.asarray(direction, dtype=float)
    if n.ndim == 0 or n.shape[-1] != 3 or not np.isfinite(n).all():
        raise ModelError("directions must be vectors of three finite numbers")
    size = np.linalg.norm(n, axis=-1, keepdims=True)
    if (size == 0.0).any():
        raise ModelError("a direction is the zero vector; give it a direction")
    return np.asarray(n / size)


def _frequency(eigenvalue: float, free: bool, density: float | None) -> float:
    if density is None or (eigenvalue < 0.0 and not free):
        return math.nan
    return math.sqrt(max(eigenvalue, 0.0)) / (2.0 * math.pi)


def _letters(axis: Array) -> str:
    k = int(np.argmax(np.abs(axis)))
    return "xyz"[k] if abs(axis[k]) > 1.0 - RANK else f"({', '.join(f'{c:.3g}' for c in axis)})"
