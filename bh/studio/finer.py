"""The state of the window on a finer mesh, and from both the error of the energy: what is solved while nobody drags.

It begins at the shape of the coarser mesh, so it stays on the branch that is seen, and ends where it is told to.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import InputError
from bh.formulations.protocols import PlacedSystem, Refinable
from bh.formulations.registry import formulation
from bh.formulations.state import State
from bh.live import Controls, Frame, Grip
from bh.live.controls import Way
from bh.loading.builder import LoadStepBuilder
from bh.model.model import Model
from bh.model.refinement import DEFAULT
from bh.model.step import Step
from bh.model.supports import Support
from bh.runtime.threads import one_blas_thread
from bh.solvers.newton import Newton, Solution
from bh.solvers.system import System
from bh.solving.accuracy import ORDERS
from bh.solving.coarser import places
from bh.solving.given_mesh import TWO_MESHES
from meshes import SheetMesh
from meshes.choices import cut

Array = NDArray[np.float64]
MOST = 16_000  # triangles of the finest mesh
ELSEWHERE = 0.1  # of the sheet's size: a finer mesh whose shape is farther off is on another branch
NOTHING = 1e-12  # N mm; a sheet with less is flat, and has no relative error


@dataclass(frozen=True, eq=False)
class Finer:
    """What a finer mesh says of a state.

    Attributes:
        state: on the finest mesh that was solved; None where there is none.
        error: relative, of its energy; None where it is not known.
        reason: why there is no state, or no finer one though the accuracy is not reached; or an empty string.
    """

    state: State | None = None
    error: float | None = None
    reason: str = ""


def finer(model: Model, frame: Frame, going: Callable[[], bool], within: float = DEFAULT) -> Finer | None:
    """A state at rest on meshes with cells half as large each, until the energy is as accurate as wanted.

    Args:
        model: of the sheet, without steps.
        frame: at rest.
        going: asked between two iterations; False ends it.
        within: relative error of the energy that is wanted.

    Returns:
        what was found; None where it was ended.
    """
    why = _why_not(model, frame)
    if why:
        return Finer(reason=why)
    found, state, controls = Finer(), frame.state, frame.wanted
    while found.error is None or found.error > within:
        cells = model.mesh.cells
        assert cells is not None
        assert model.mesh.pattern is not None
        try:
            mesh = cut(model.mesh.pattern, cells.refined())
            if len(mesh.triangles) > MOST:
                return replace(found, reason=f"a finer mesh has more than {MOST:,} triangles")
            model, controls, guess = _moved(model, mesh, state, controls)
            with one_blas_thread():
                there = _solve(model, controls, guess, going)
        except InputError as refused:
            return replace(found, reason=str(refused).split(";")[0])
        if there is None:
            return None
        if isinstance(there, str):
            return replace(found, reason=there)
        nodes, weights = places(model.mesh, state.mesh.points)
        off = np.linalg.norm(
            np.einsum("nk,nkd->nd", weights, there.points[nodes]) - state.points, axis=1
        ).max()
        if off > ELSEWHERE * float(np.ptp(mesh.points, axis=0).max()):
            return replace(found, reason="on a finer mesh the sheet goes to another branch")
        energy = there.energy.total
        error = TWO_MESHES * abs(energy - state.energy.total) / (2.0 ** ORDERS[1] - 1.0)
        found, state = Finer(there, error / max(energy, NOTHING)), there
    return found


def _why_not(model: Model, frame: Frame) -> str:
    known = formulation(model.formulation)
    if not (isinstance(known, Refinable) and known.refinement):
        return f"{model.formulation} are not known to converge under refinement"
    if model.mesh.pattern is None or model.mesh.cells is None:
        return "this mesh was given, and knows no finer one"
    if model.stiffness is not None:
        return "given element stiffness belongs to this mesh"
    return "the sheet is flat" if frame.state.energy.total < NOTHING else ""


def _moved(model: Model, mesh: SheetMesh, state: State, wanted: Controls) -> tuple[Model, Controls, Array]:
    """Model and controls on another mesh, whose nearest nodes take over, and the shape there (n, 3), mm."""
    from scipy.spatial import cKDTree

    old = model.mesh
    nodes, weights = places(old, mesh.points)
    shape = mesh.points + np.einsum("nk,nkd->nd", weights, (state.points - old.points)[nodes])
    tree = cKDTree(mesh.points)

    def nearest(node: int) -> int:
        return int(tree.query(old.points[node])[1])

    supports = tuple(
        replace(each, at=[nearest(int(node)) for node in each.at])
        if isinstance(each, Support) and not isinstance(each.at, str)
        else each
        for each in model.supports
    )
    grips = {}
    for node, grip in wanted.grips.items():
        there = nearest(node)
        x, y, z = (np.array(grip.to) + shape[there] - state.points[node]).tolist()
        grips[there] = Grip((x, y, z), grip.stiffness)
    mesh = replace(mesh, folds=old.folds)
    return replace(model, mesh=mesh, supports=supports), Controls(wanted.folds, grips), shape


def _solve(model: Model, wanted: Controls, shape: Array, going: Callable[[], bool]) -> State | str | None:
    """The equilibrium with controls next to a shape (n, 3); why there is none; None where it was ended."""
    start = replace(wanted, folds=dict.fromkeys(wanted.folds, 0.0))
    load = LoadStepBuilder(model).build(Step(Way(start, wanted).actuations(model)))
    known = formulation(model.formulation)
    system = known.system(model, load, None)
    if not isinstance(system, PlacedSystem):
        return f"{model.formulation} cannot begin at a shape"
    run = _newton(system, system.unknowns_at(shape, 1.0))
    while going():
        try:
            next(run)
        except StopIteration as done:
            found: Solution = done.value
            if not found.converged or found.stable is False:
                return f"no stable state was found on a finer mesh ({found.reason or 'it is a saddle'})"
            return known.observe(model, system, found.q, 1.0, 0, found.stable)
    return None


def _newton(system: System, q: Array) -> Generator[Array, None, Solution]:
    """Full steps, and where they do not converge downhill."""
    newton = Newton(transient=None)
    found = yield from newton.full_steps(system, q, 1.0)
    if not found.converged:
        found = yield from newton.globalised_steps(system, q, 1.0)
    return found
