"""Sensitivities of a solved state to the design: geometry, rest angles, L*, thickness, anything that makes a model.

With unknowns q, residual r(q, d) = 0 of element data d (stress-free lengths, stiffnesses, rest angles, loads, places of
supports), the design p behind them and an observable J, the adjoint a of the factorised tangent K = dr/dq gives

    K a = dJ/dq,        dJ/dp = (partial J / partial d - a . partial r / partial d) . dd/dp,

one solve for each observable and any number of design parameters. Here q are the places of the free nodes, with the
edge rotations or moments that go with them: they stay while the stress-free sheet changes under them.

K, a and both partial derivatives are exact (`bh.formulations.protocols.Derivatives`). dd/dp comes from the function
that makes the model: central differences of sixth order of the element data. No solution and no residual is
differenced, only smooth closed formulas such as a length or E t^3 L^2 / (6 A). Their error is measured as the distance
to differences of fourth order and reported (`Sensitivity.error`). Of a stiffness the derivative of K along the sheet's
response is differenced as well. Where a pinch goes on from angles that the step before came to, the adjoint of that
step's end follows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis.situation import Situation
from bh.errors import ModelError
from bh.formulations.protocols import Data
from bh.loading.builder import load_steps
from bh.loading.load_step import crease_hinges
from bh.model.model import Model
from bh.model.supports import directions, select
from bh.paths.path import Path
from bh.runtime.one_line import OneLine
from bh.runtime.threads import one_blas_thread

Array = NDArray[np.float64]
Build = Callable[[Array], Model]
STEP = 1e-3  # of a parameter
OFFSETS = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
SIXTH = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
FOURTH = np.array([0.0, 1.0, -8.0, 8.0, -1.0, 0.0]) / 12.0
ALONG = 1e-3  # of the shortest edge: how far a state is moved along a response
KINDS = ("stretching", "bending", "folding")


class Slope(NamedTuple):
    """Derivatives of an observable: to all node positions (n, 3), to the unknowns after the displacements, to data."""

    points: Array
    other: Array
    data: Data


class Observable(Protocol):
    """A number that is read from a state."""

    def value(self, at: Situation) -> float:
        """The number itself."""
        ...

    def slope(self, at: Situation) -> Slope:
        """Its derivatives."""
        ...


@dataclass(frozen=True)
class Position:
    """Mean position of a place along a direction, mm: `Position("corner:outer-end", "z")`."""

    at: str | Sequence[int]
    direction: str | Sequence[float]

    def forces(self, at: Situation) -> Array:
        """(n, 3) unit force along the direction, shared equally among the nodes.

        Raises:
            ModelError: the direction is not one direction.
        """
        nodes = select(at.model.mesh, self.at)
        axes = directions(self.direction if isinstance(self.direction, str) else [self.direction])
        if len(axes) != 1:
            raise ModelError(f"direction '{self.direction}' is not one direction; give x, y, z or a vector")
        forces = np.zeros_like(at.model.mesh.points)
        forces[nodes] = axes[0] / len(nodes)
        return forces

    def value(self, at: Situation) -> float:
        """Mean coordinate along the direction, mm."""
        return float(np.vdot(self.forces(at), at.state.points))

    def slope(self, at: Situation) -> Slope:
        """Unit force along the direction."""
        return Slope(self.forces(at), np.zeros(len(at.q) - at.moving), {})


@dataclass(frozen=True)
class Energy:
    """Elastic energy: "total", "stretching", "bending" or "folding", N mm."""

    kind: str = "total"

    def __post_init__(self) -> None:
        """See that the kind is known.

        Raises:
            ModelError: it is not.
        """
        if self.kind not in ("total", *KINDS):
            raise ModelError(f"energy '{self.kind}' is not known; use total, {', '.join(KINDS)}")

    def value(self, at: Situation) -> float:
        """Energy of the kind, N mm."""
        return float(getattr(at.state.energy, self.kind))

    def slope(self, at: Situation) -> Slope:
        """Forces and moments of the kind, and what its data do to it."""
        kinds = KINDS if self.kind == "total" else (self.kind,)
        points, other = at.derivatives.energy_gradient(kinds)
        return Slope(points, other, at.derivatives.energy_to_data(kinds))


@dataclass(frozen=True)
class FoldAngle:
    """Fold angle pi - phi of a crease, rad: the mean over its edges, or that of one edge (counted from 0)."""

    crease: str
    edge: int | None = None

    def _hinges(self, at: Situation) -> NDArray[np.int64]:
        hinges = crease_hinges(at.model.mesh, self.crease)
        if self.edge is None:
            return hinges
        if not -len(hinges) <= self.edge < len(hinges):
            raise ModelError(f"crease '{self.crease}' has {len(hinges)} edges, none of number {self.edge}")
        return hinges[[self.edge]]

    def value(self, at: Situation) -> float:
        """Mean fold angle, rad; mountain positive."""
        return float(np.pi - at.state.dihedral_angles[self._hinges(at)].mean())

    def slope(self, at: Situation) -> Slope:
        """Gradients of the angle, rad / mm."""
        hinges = self._hinges(at)
        return Slope(*at.derivatives.angle_gradient(hinges, np.full(len(hinges), -1.0 / len(hinges))))


@dataclass(frozen=True)
class OfPoints:
    """Any function of the node positions: `function(points)` gives its value and its gradient (n, 3)."""

    function: Callable[[Array], tuple[float, Array]]

    def value(self, at: Situation) -> float:
        """What the function gives."""
        return float(self.function(at.state.points)[0])

    def slope(self, at: Situation) -> Slope:
        """The gradient that the function gives.

        Raises:
            ModelError: it is not of the shape of the points.
        """
        gradient = np.asarray(self.function(at.state.points)[1], dtype=float)
        if gradient.shape != at.state.points.shape:
            raise ModelError(
                f"the gradient of a function of points has shape {gradient.shape}; give one like points"
            )
        return Slope(gradient, np.zeros(len(at.q) - at.moving), {})


@dataclass(frozen=True)
class OfNodes:
    """A function of a few node positions (m, 3) that also takes complex ones: its gradient is a complex step, exact.

    No absolute values or comparisons in it; `np.sqrt((d * d).sum())` rather than `np.linalg.norm(d)`.
    """

    nodes: Sequence[int]
    function: Callable[[NDArray[np.float64 | np.complex128]], complex]

    def value(self, at: Situation) -> float:
        """What the function gives."""
        return float(np.real(self.function(at.state.points[list(self.nodes)])))

    def slope(self, at: Situation) -> Slope:
        """The gradient of the function by a complex step, exact to rounding."""
        places = at.state.points[list(self.nodes)]
        points = np.zeros_like(at.state.points)
        for i, node in enumerate(self.nodes):
            for axis in range(3):
                moved = places.astype(complex)
                moved[i, axis] += 1e-100j
                points[node, axis] += float(np.imag(self.function(moved))) / 1e-100
        return Slope(points, np.zeros(len(at.q) - at.moving), {})


@dataclass(frozen=True)
class Stiffness:
    """Stiffness of a place along a direction, N/mm: a force over the displacement along it.

    The force is shared equally among the nodes and the displacement is their mean; they are free to move across
    (`stiffness_probe.Stiffness.loaded`).
    """

    at: str | Sequence[int]
    direction: str | Sequence[float]

    def _response(self, at: Situation) -> tuple[float, Array]:
        load = at.system.loads(Position(self.at, self.direction).forces(at))
        w = at.solve(load)
        return 1.0 / float(load @ w), w

    def value(self, at: Situation) -> float:
        """Stiffness, N / mm."""
        return self._response(at)[0]

    def slope(self, at: Situation) -> Slope:
        """K^2 times the derivatives of w . K w with w = C load: the third derivative of the energy along w twice."""
        stiffness, w = self._response(at)
        v, other = at.system.vectors(w), w[at.moving :]
        ends = at.model.mesh.points[at.model.mesh.topology.edges]
        short = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min())
        step = ALONG * short / float(np.abs(v).max())
        beside = (at.formulation.derivatives(at.system, at.q + k * step * w, at.lam) for k in OFFSETS)
        moved = [there.second_variation(v, other) for there in beside]
        scale = stiffness**2
        points, rest = (
            scale / step * np.tensordot(SIXTH, np.array([m[part] for m in moved]), 1) for part in range(2)
        )
        data = {key: scale * value for key, value in at.derivatives.second_to_data(v, other).items()}
        return Slope(points, rest, data)


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivity(OneLine):
    """How an observable changes with the design.

    Attributes:
        value: of the observable.
        gradient: (k,) derivatives with respect to the parameters.
        error: (k,) measured error of the differences of element data in it (sixth against fourth order).
    """

    value: float
    gradient: Array
    error: Array


def of(
    path: Path,
    build: Build,
    design: ArrayLike,
    observables: Sequence[Observable],
    index: int = -1,
    steps: ArrayLike | None = None,
) -> list[Sensitivity]:
    """Sensitivities of observables of a state to the parameters of a design.

    Args:
        path: solved, of `build(design)`.
        build: makes the model of a design (k,): geometry by a parametrised pattern and a mesh of fixed topology, sheet,
            creases, rest angles, forces, whatever a model has. It must be smooth near the design.
        design: (k,) parameters of the solved path.
        observables: `Position`, `Energy`, `FoldAngle`, `Stiffness`, `OfPoints` or any `Observable`.
        index: of the state, at the end of a step (in the first step any).
        steps: (k,) of the differences, by default a thousandth of each parameter (0.001 where it is zero).

    Returns:
        one for each observable.

    Raises:
        ModelError: the path is not that of the design, its topology changes, the state cannot have sensitivities.
    """
    p = np.atleast_1d(np.asarray(design, dtype=float))
    if p.ndim != 1 or not np.isfinite(p).all():
        raise ModelError("a design is a list of finite numbers")
    h = np.where(p == 0.0, STEP, STEP * np.abs(p)) if steps is None else np.asarray(steps, dtype=float)
    if h.shape != p.shape or not (h > 0.0).all():
        raise ModelError(f"steps must be {len(p)} positive numbers, one for each parameter")
    with one_blas_thread():
        at = Situation(path, index)
        around = _Around(build, p, h, at.model)
        return [_sensitivity(at, observable, around) for observable in observables]


def _sensitivity(at: Situation, observable: Observable, around: _Around) -> Sensitivity:
    value = observable.value(at)
    return Sensitivity(value, *_gradient(at, observable.slope(at), value, around))


def _gradient(at: Situation, slope: Slope, value: float, around: _Around) -> tuple[Array, Array]:
    """(k,) derivatives to the parameters and their measured errors."""
    by_data = derivatives_to_data(at, slope, value)
    rates = around.rates(at)
    gradient = np.array(
        [sum(float(np.vdot(by_data[key], rate[key])) for key in by_data) for rate, _ in rates]
    )
    error = np.array(
        [sum(float(np.vdot(np.abs(by_data[key]), off[key])) for key in by_data) for _, off in rates]
    )
    # what a pinch imposes follows from the angles that its step began with
    pinch = load_steps(at.model)[at.step].pinch
    weights = np.where(np.isnan(pinch.base) & ~np.isnan(pinch.toward), 1.0 - pinch.part, 0.0)
    weights = weights * at.derivatives.imposed(by_data)
    follows = np.flatnonzero(weights)
    if len(follows) == 0:
        return gradient, error
    earlier = Slope(*at.previous.derivatives.angle_gradient(follows, weights[follows]))
    more = _gradient(at.previous, earlier, float(np.abs(weights).sum()), around)
    return gradient + more[0], error + more[1]


def derivatives_to_data(at: Situation, slope: Slope, value: float) -> Data:
    """Derivatives of an observable to element data at equilibrium: its own, and by way of the state (the adjoint).

    Args:
        at: the state that is asked about.
        slope: derivatives of the observable, in its unit.
        value: of the observable, in its unit.
    """
    adjoint = at.solve(at.load(slope.points, slope.other), value)
    v, w = at.system.vectors(adjoint), adjoint[at.moving :]
    by_data = {key: -part for key, part in at.derivatives.residual_to_data(v, w).items()}
    # nodes that supports hold move with them
    by_data["places"] = slope.points - at.derivatives.second_variation(v, w)[0]
    for key, part in slope.data.items():
        by_data[key] = by_data[key] + part if key in by_data else part
    return by_data


class _Around:
    """Models beside a design, and how the element data of situations change with it."""

    def __init__(self, build: Build, p: Array, steps: Array, solved: Model) -> None:
        _same(build(p), solved)
        self.steps = steps
        moved = [
            [p + offset * h * row for offset in OFFSETS] for h, row in zip(steps, np.eye(len(p)), strict=True)
        ]
        self.models = [[build(point) for point in points] for points in moved]
        if any(
            not np.array_equal(m.mesh.triangles, solved.mesh.triangles) for row in self.models for m in row
        ):
            raise ModelError("the mesh changes its triangles with the design; keep the number of cells fixed")
        self._known: dict[int, list[tuple[Data, Data]]] = {}

    def rates(self, at: Situation) -> list[tuple[Data, Data]]:
        """For each parameter derivatives of the element data of a situation, and their measured errors."""
        if at.step not in self._known:
            self._known[at.step] = [
                differences([data_of(at, model) for model in row], h, at.derivatives.unfollowed)
                for row, h in zip(self.models, self.steps, strict=True)
            ]
        return self._known[at.step]


def data_of(at: Situation, model: Model) -> Data:
    """Element data of another model where a situation is.

    Args:
        at: the state of the first model.
        model: of another design, with the same unknowns.

    Raises:
        ModelError: the unknowns, or the directions of oblique supports, change with the design.
    """
    system = at.formulation.system(model, load_steps(model)[at.step], at.start)
    if system.size != at.system.size:
        raise ModelError("the unknowns change with the design; keep supports and creases fixed")
    here, there = at.system.constraints, system.constraints
    if here.frames.shape != there.frames.shape or not np.allclose(
        here.frames, there.frames, rtol=0.0, atol=1e-12
    ):
        raise ModelError("the directions of oblique supports change with the design; keep them fixed")
    return at.formulation.derivatives(system, at.q, at.lam).data()


def differences(around: list[Data], h: float, unfollowed: Mapping[str, str]) -> tuple[Data, Data]:
    """Derivatives of element data by a parameter, from six samples.

    Args:
        around: data of the models at the parameter plus h times `OFFSETS`, in that order.
        h: step of the parameter.
        unfollowed: names of data that must not change, and what to say if they do (`Derivatives.unfollowed`).

    Returns:
        the derivatives, of sixth order, and their distances from those of fourth order.

    Raises:
        ModelError: data change by which no derivative is known.
    """
    rates, errors = {}, {}
    for key in around[0]:
        samples = np.array([data[key] for data in around])
        rates[key] = np.tensordot(SIXTH, samples, 1) / h
        errors[key] = np.abs(np.tensordot(SIXTH - FOURTH, samples, 1)) / h
    for key, why in unfollowed.items():
        if np.abs(rates[key]).max(initial=0.0) > 0.0:
            raise ModelError(why)
    return rates, errors


def _same(model: Model, solved: Model) -> None:
    mesh, other = solved.mesh, model.mesh
    if mesh.points.shape != other.points.shape or not np.allclose(
        mesh.points, other.points, rtol=0.0, atol=1e-9 * mesh.size
    ):
        raise ModelError("the path is not that of this design: build(design) makes another mesh")
    if model.sheet != solved.sheet or model.formulation != solved.formulation:
        raise ModelError(
            "the path is not that of this design: build(design) makes another sheet or formulation"
        )
