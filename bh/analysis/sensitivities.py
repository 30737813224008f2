"""Sensitivities of a solved state to the design: geometry, rest angles, L*, thickness, anything that makes a model.

With unknowns q, residual r(q, d) = 0 of element data d (stress-free lengths, stiffnesses, rest angles, loads, places of
supports), the design p behind them and an observable J, the adjoint a of the factorised tangent K = dr/dq gives

    K a = dJ/dq,        dJ/dp = (partial J / partial d - a . partial r / partial d) . dd/dp,

one solve for each observable and any number of design parameters. Here q are the places of the free nodes, with the
edge rotations or moments that go with them: they stay while the stress-free sheet changes under them.

K, a and both partial derivatives are exact (`bh.mechanics.bars_and_hinges.derivatives`, `consistent_design`). dd/dp comes from the
function that makes the model: central differences of sixth order of the element data. No solution and no residual is
differenced, only smooth closed formulas such as a length or E t^3 L^2 / (6 A). Their error is measured as the distance
to differences of fourth order and reported (`Sensitivity.error`). Of a stiffness the derivative of K along the sheet's
response is differenced as well. Where a pinch goes on from angles that the step before came to, the adjoint of that
step's end follows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import ModelError
from bh.formulations.observables import until_of
from bh.formulations.registry import formulation
from bh.formulations.state import State
from bh.loading.load_step import crease_hinges
from bh.loading.program import program
from bh.model.model import Model
from bh.model.supports import directions, select
from bh.paths.path import Path
from bh.runtime.threads import one_blas_thread
from bh.solvers.factor import Factor, IndefiniteError
from bh.solvers.matrices import FreeBodyMatrix
from bh.solvers.saddle import MultiplierMatrix

Array = NDArray[np.float64]
Data = dict[str, Array]
Build = Callable[[Array], Model]
STEP = 1e-3  # of a parameter
OFFSETS = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
SIXTH = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
FOURTH = np.array([0.0, 1.0, -8.0, 8.0, -1.0, 0.0]) / 12.0
ALONG = 1e-3  # of the shortest edge: how far a state is moved along a response
UNBALANCED = 1e-8  # part of an observable's gradient along motions that are free
REFINED = 2
KINDS = ("stretching", "bending", "folding")


class Slope(NamedTuple):
    """Derivatives of an observable: to all node positions (n, 3), to the unknowns after the displacements, to data."""

    points: Array
    other: Array
    data: Data


class Situation:
    """A solved state with its factorised tangent: what observables are read from."""

    def __init__(self, path: Path, index: int) -> None:
        self.path, self.model = path, path.model
        self.system, record = path.solved(index)
        if not hasattr(self.system, "design"):
            raise ModelError(
                f"formulation '{path.model.formulation}' has no sensitivities; use bars-and-hinges or consistent"
            )
        if record.step > 0 and record.lam != 1.0:
            raise ModelError(
                f"the state at lambda {record.lam:.4g} of step {record.step + 1} depends on the step before; "
                "take its end"
            )
        if any(until_of(step) is not None for step in path.model.steps[: record.step + 1]):
            raise ModelError(
                "a step that ends where an observable has a value has no sensitivities; give it its end"
            )
        if self.system.touching is not None:
            raise ModelError("sheets that bars press on have no sensitivities; leave the bars out")
        self.step, self.q, self.lam = record.step, record.q, record.lam
        self.state: State = path[index]
        before = [i for i, other in enumerate(path.records) if other.step < record.step]
        self._before = before[-1] if before else None
        self.start: State | None = None if self._before is None else path[self._before]
        self.moving = int(self.system.moving)
        self.matrix = self.system.tangent(self.q, self.lam, self.system.evaluate(self.q, self.lam).forces)
        try:
            self._factor: Factor = self.matrix.factorise_any()[0]
        except IndefiniteError:
            raise ModelError(
                "the tangent of this state is singular: it has no sensitivities; add supports"
            ) from None
        inner = self.matrix.augmented if isinstance(self.matrix, MultiplierMatrix) else self.matrix
        self._rigid = np.zeros((len(self.q), 0))
        if isinstance(inner, FreeBodyMatrix):
            self._rigid = np.zeros((len(self.q), inner.Z.shape[1]))
            self._rigid[: len(inner.Z)] = inner.Z

    @cached_property
    def previous(self) -> Situation:
        """The last state of the step before."""
        assert self._before is not None
        return Situation(self.path, self._before)

    @cached_property
    def design(self) -> Any:
        """Exact derivatives of the system at this state."""
        return self.system.design(self.q, self.lam)

    def solve(self, load: Array, value: float = 0.0) -> Array:
        """Response (size,) of the unknowns to a load, the slope of an observable of that value.

        Raises:
            ModelError: a free sheet would be moved as a rigid body.
        """
        along = self._rigid.T @ load
        size = max(float(np.linalg.norm(load)), abs(value) / self.model.mesh.size)
        if np.linalg.norm(along) > UNBALANCED * size:
            raise ModelError(
                "this observable changes when the sheet moves as a rigid body, which nothing prevents; give the model "
                "supports, or observe something else"
            )
        load = load - self._rigid @ along
        x = self._factor.solve(load)
        for _ in range(REFINED):
            x = x + self._factor.solve(load - self.matrix @ x)
        return np.asarray(x - self._rigid @ (self._rigid.T @ x))

    def load(self, points: Array, other: Array) -> Array:
        """(size,) derivatives to the unknowns from those to all positions and to the other unknowns."""
        out = np.array(self.system.loads(points))
        out[self.moving :] += other
        return out


class Observable(Protocol):
    """A number that is read from a state."""

    def value(self, at: Situation) -> float: ...

    def slope(self, at: Situation) -> Slope: ...


@dataclass(frozen=True)
class Position:
    """Mean position of a place along a direction, mm: `Position("corner:outer-end", "z")`."""

    at: str | Sequence[int]
    direction: str | Sequence[float]

    def forces(self, at: Situation) -> Array:
        """(n, 3) unit force along the direction, shared equally among the nodes."""
        nodes = select(at.model.mesh, self.at)
        axes = directions(self.direction if isinstance(self.direction, str) else [self.direction])
        if len(axes) != 1:
            raise ModelError(f"direction '{self.direction}' is not one direction; give x, y, z or a vector")
        forces = np.zeros_like(at.model.mesh.points)
        forces[nodes] = axes[0] / len(nodes)
        return forces

    def value(self, at: Situation) -> float:
        return float(np.vdot(self.forces(at), at.state.points))

    def slope(self, at: Situation) -> Slope:
        return Slope(self.forces(at), np.zeros(len(at.q) - at.moving), {})


@dataclass(frozen=True)
class Energy:
    """Elastic energy: "total", "stretching", "bending" or "folding", N mm."""

    kind: str = "total"

    def __post_init__(self) -> None:
        if self.kind not in ("total", *KINDS):
            raise ModelError(f"energy '{self.kind}' is not known; use total, {', '.join(KINDS)}")

    def value(self, at: Situation) -> float:
        return float(getattr(at.state.energy, self.kind))

    def slope(self, at: Situation) -> Slope:
        kinds = KINDS if self.kind == "total" else (self.kind,)
        points, other = at.design.energy_gradient(kinds)
        return Slope(points, other, at.design.energy_to_data(kinds))


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
        return float(np.pi - at.state.dihedral_angles[self._hinges(at)].mean())

    def slope(self, at: Situation) -> Slope:
        hinges = self._hinges(at)
        return Slope(*at.design.angle_gradient(hinges, np.full(len(hinges), -1.0 / len(hinges))))


@dataclass(frozen=True)
class OfPoints:
    """Any function of the node positions: `function(points)` gives its value and its gradient (n, 3)."""

    function: Callable[[Array], tuple[float, Array]]

    def value(self, at: Situation) -> float:
        return float(self.function(at.state.points)[0])

    def slope(self, at: Situation) -> Slope:
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
    function: Callable[[Any], Any]

    def value(self, at: Situation) -> float:
        return float(np.real(self.function(at.state.points[list(self.nodes)])))

    def slope(self, at: Situation) -> Slope:
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
        return self._response(at)[0]

    def slope(self, at: Situation) -> Slope:
        """K^2 times the derivatives of w . K w with w = C load: the third derivative of the energy along w twice."""
        stiffness, w = self._response(at)
        v, other = at.system.vectors(w), w[at.moving :]
        ends = at.model.mesh.points[at.model.mesh.topology.edges]
        short = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min())
        step = ALONG * short / float(np.abs(v).max())
        moved = [at.system.design(at.q + k * step * w, at.lam).second_variation(v, other) for k in OFFSETS]
        scale = stiffness**2
        points, rest = (
            scale / step * np.tensordot(SIXTH, np.array([m[part] for m in moved]), 1) for part in range(2)
        )
        data = {key: scale * value for key, value in at.design.second_to_data(v, other).items()}
        return Slope(points, rest, data)


@dataclass(frozen=True, eq=False)
class Sensitivity:
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
        observables: `Position`, `Energy`, `FoldAngle`, `Stiffness`, `OfPoints` or any `Observable`.
        index: of the state, at the end of a step (in the first step any).
        steps: (k,) of the differences, by default a thousandth of each parameter (0.001 where it is zero).

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
    pinch = program(at.model)[at.step].pinch
    weights = np.where(np.isnan(pinch.base) & ~np.isnan(pinch.toward), 1.0 - pinch.part, 0.0)
    weights = weights * at.design.imposed(by_data)
    follows = np.flatnonzero(weights)
    if len(follows) == 0:
        return gradient, error
    earlier = Slope(*at.previous.design.angle_gradient(follows, weights[follows]))
    more = _gradient(at.previous, earlier, float(np.abs(weights).sum()), around)
    return gradient + more[0], error + more[1]


def derivatives_to_data(at: Situation, slope: Slope, value: float) -> Data:
    """Derivatives of an observable to element data at equilibrium: its own, and by way of the state (the adjoint)."""
    adjoint = at.solve(at.load(slope.points, slope.other), value)
    v, w = at.system.vectors(adjoint), adjoint[at.moving :]
    by_data = {key: -part for key, part in at.design.residual_to_data(v, w).items()}
    # nodes that supports hold move with them
    by_data["places"] = slope.points - at.design.second_variation(v, w)[0]
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
                differences([data_of(at, model) for model in row], h)
                for row, h in zip(self.models, self.steps, strict=True)
            ]
        return self._known[at.step]


def data_of(at: Situation, model: Model) -> Data:
    """Element data of another model where a situation is."""
    system = formulation(model.formulation).system(model, program(model)[at.step], at.start)
    if system.size != at.system.size:
        raise ModelError("the unknowns change with the design; keep supports and creases fixed")
    here, there = at.system.constraints, system.constraints
    if here.frames.shape != there.frames.shape or not np.allclose(
        here.frames, there.frames, rtol=0.0, atol=1e-12
    ):
        raise ModelError("the directions of oblique supports change with the design; keep them fixed")
    data: Data = system.design(at.q, at.lam).data()
    return data


def differences(around: list[Data], h: float) -> tuple[Data, Data]:
    rates, errors = {}, {}
    for key in around[0]:
        samples = np.array([data[key] for data in around])
        rates[key] = np.tensordot(SIXTH, samples, 1) / h
        errors[key] = np.abs(np.tensordot(SIXTH - FOURTH, samples, 1)) / h
    if "ghost" in rates and np.abs(rates["ghost"]).max(initial=0.0) > 0.0:
        raise ModelError(
            "sensitivities to geometry do not know clamped edges; hold their nodes, or keep the geometry"
        )
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
