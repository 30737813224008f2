"""Case `derivatives`: kernels against finite differences, rigid motion, and energy against force along a path."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import LoadControl, Model, Newton, Sheet, trace
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.shared import kinematics
from verification.framework.checks import CaseResult, Context

Array = NDArray[np.float64]
HINGE = np.array([[0, 1, 2, 3]])
FLAT = np.array([[-1.0, 0.4, 0.0], [0.0, 0.0, 0.0], [0.0, 1.3, 0.0], [1.2, 0.7, 0.0]])


def configurations(seed: int = 3) -> dict[str, Array]:
    """Hinges to differentiate: random, flat, almost closed on either side, slender."""
    rng = np.random.default_rng(seed)
    found = {f"random {i}": rng.normal(size=(4, 3)) for i in range(5)}
    found["flat"] = FLAT
    for name, angle in (
        ("almost closed", 0.02),
        ("almost closed, valley", 2.0 * math.pi - 0.02),
        ("right angle", math.pi / 2),
    ):
        found[name] = folded(angle)
    slender = folded(2.5)
    slender[[0, 3], 0] *= 1e-3
    slender[[0, 3], 2] *= 1e-3
    found["slender"] = slender
    return found


def folded(dihedral: float) -> Array:
    """The hinge FLAT folded to a dihedral angle: each wing turned down by half of the fold angle."""
    half = 0.5 * (math.pi - dihedral)
    out = FLAT.copy()
    for wing in (0, 3):
        out[wing, 0], out[wing, 2] = FLAT[wing, 0] * math.cos(half), -abs(FLAT[wing, 0]) * math.sin(half)
    return out


def central_difference(f, x: Array, step: float) -> Array:  # type: ignore[no-untyped-def]
    """Fourth-order central differences of f with respect to all entries of x; last axis runs over them."""
    columns = []
    for i in range(x.size):
        e = np.zeros(x.shape)
        e.ravel()[i] = step
        columns.append((8.0 * (f(x + e) - f(x - e)) - (f(x + 2 * e) - f(x - 2 * e))) / (12.0 * step))
    return np.stack(columns, axis=-1)


def hinge_errors(x: Array) -> tuple[float, float]:
    """Relative errors of gradient and Hessian of one hinge."""
    # the angle varies on the scale of the heights of the wings, so the step follows the smaller one
    step = 1e-3 / float(np.abs(kinematics.dihedral_gradients(x, HINGE)[0]).max())
    g = kinematics.dihedral_gradients(x, HINGE)[0]
    H = kinematics.dihedral_hessians(x, HINGE)[0]
    g_fd = central_difference(lambda y: kinematics.dihedral_angles(y, HINGE)[0], x, step)
    H_fd = central_difference(lambda y: kinematics.dihedral_gradients(y, HINGE)[0], x, step)
    return (float(np.abs(g - g_fd).max() / np.abs(g).max()), float(np.abs(H - H_fd).max() / np.abs(H).max()))


def random_rotation(rng: np.random.Generator) -> Array:
    """A random proper rotation (3, 3)."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    proper: Array = Q * np.sign(np.linalg.det(Q))
    return proper


def small_model() -> Model:
    """A small sheet with a spring crease, an imposed crease, a force and supports in oblique directions."""
    pattern = meshes.annulus_sector((40.0, 50.0), 8.0, 0.6, ("mountain", "valley"))
    mesh = meshes.structured(pattern, along=6)
    from bh import Fold, Force

    model = Model(mesh, Sheet(E=4000.0, t=0.2), formulation="bars-and-hinges", contact=False)
    model = model.support("edge:start", "xyz").support("corner:inner-end", [[0.0, 1.0, 1.0]])
    return model.step(
        Fold("crease-1", rest=2.0, Lstar=5.0),
        Fold("crease-2", to=4.0),
        Force("edge:end", each=(0.0, 0.01, 0.02)),
    ).displace("corner:outer-end", (1.0, 1.0, 0.0), 0.3)


def system_errors(seed: int = 5) -> dict[str, float]:
    """Residual against energy, tangent and control rate against residual, power against energy; relative errors."""
    model = small_model()
    rng = np.random.default_rng(seed)
    worst: dict[str, float] = {}
    start = None
    for step, item in enumerate(load_steps(model)):
        system = formulation(model.formulation).system(model, item, start)
        q = system.start() + np.concatenate(
            (0.05 * rng.normal(size=system.primal), 0.1 * rng.normal(size=system.size - system.primal))
        )
        for name, error in differences(system, q, 0.37, rng).items():
            worst[name] = max(worst.get(name, 0.0), error)
        if step == 0:
            solution = Newton().solve(system, system.start(), 0.0)
            start = formulation(model.formulation).observe(model, system, solution.q, 0.0)
    return worst


def differences(system, q: Array, lam: float, rng: np.random.Generator) -> dict[str, float]:  # type: ignore[no-untyped-def]
    """Relative errors of the first and second derivatives of a system along a random direction."""
    v = rng.normal(size=len(q))
    step = 1e-4

    def along(f, axis: str = "q"):  # type: ignore[no-untyped-def]
        def at(k: float):  # type: ignore[no-untyped-def]
            return f(q + k * step * v, lam) if axis == "q" else f(q, lam + k * step)

        return (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * step)

    def relative(exact, fd) -> float:  # type: ignore[no-untyped-def]
        return float(np.abs(exact - fd).max() / max(np.abs(exact).max(), 1e-300))

    now = system.evaluate(q, lam)
    matrix = system.tangent(q, lam, now.forces).matrix
    return {
        "residual": relative(now.residual @ v, along(lambda a, b: system.evaluate(a, b).energy)),
        "tangent": relative(matrix @ v, along(lambda a, b: system.evaluate(a, b).residual)),
        "control rate": relative(
            system.control_rate(q, lam), along(lambda a, b: system.evaluate(a, b).residual, "lambda")
        ),
        "power": relative(system.power(q, lam), along(lambda a, b: system.evaluate(a, b).energy, "lambda")),
        "control stiffness": relative(system.control_stiffness(q, lam), along(system.power, "lambda")),
    }


def prediction_ratio(system, q: Array, lam: float) -> float:  # type: ignore[no-untyped-def]
    """Error of the predicted element forces for an increment over that for half of it: 4 if they are first order."""
    now = system.evaluate(q, lam)
    v = np.random.default_rng(4).normal(size=system.size)
    tangent = system.tangent(q, lam, now.forces)
    system.tangent(q + 0.1 * v, lam, now.forces)  # what is asked of the system later changes no tangent
    errors = []
    for step in (2e-3, 1e-3):
        ahead = tangent.predicted_forces(now.forces, step * v)
        errors.append(float(np.abs(ahead - system.evaluate(q + step * v, lam).forces).max()))
    return errors[0] / errors[1]


def work_mismatch(increment: float) -> tuple[float, int]:
    """Energy gained over a whole fold to 90 degrees, against Simpson's integral of the rate of work; relative error."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), along=32)
    model = Model(mesh, Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges", contact=False).fold(
        "crease", to=math.pi / 2
    )
    fixed = LoadControl(first_rotation=increment, largest_rotation=increment)
    path = trace(model, strategy=fixed)
    system = path.solved(0)[0]
    lam = np.array([record.lam for record in path.records])
    power = np.array([system.power(record.q, record.lam) for record in path.records])
    from scipy.integrate import simpson

    gained = path[-1].energy.total - path[0].energy.total
    return abs(float(simpson(power, x=lam)) / gained - 1.0), len(path)


def run(context: Context) -> CaseResult:
    """All derivative checks."""
    result = CaseResult(
        name="derivatives",
        title="Derivatives and invariance",
        question="Are the compiled gradients and Hessians exact, also where hinges are flat, closed or slender?",
        source="fourth-order central differences",
    )

    context.tell("derivatives: hinges")
    for name, x in configurations().items():
        gradient, hessian = hinge_errors(x)
        result.check(
            "dihedral gradient, relative error",
            gradient,
            reference=0.0,
            tolerance=1e-9,
            params={"hinge": name},
        )
        result.check(
            "dihedral Hessian, relative error", hessian, reference=0.0, tolerance=1e-9, params={"hinge": name}
        )
    rng = np.random.default_rng(1)
    for name, x in configurations().items():
        moved = x @ random_rotation(rng).T + rng.normal(size=3)
        change = abs(kinematics.dihedral_angles(x, HINGE)[0] - kinematics.dihedral_angles(moved, HINGE)[0])
        g = kinematics.dihedral_gradients(x, HINGE)[0].reshape(4, 3)
        scale = np.abs(g).max()
        check = partial(result.check, params={"hinge": name})
        check("angle under rigid motion, change in rad", change, reference=0.0, tolerance=1e-11)
        check(
            "gradient on translations, relative",
            np.abs(g.sum(axis=0)).max() / scale,
            reference=0.0,
            tolerance=1e-12,
        )
        torque = np.abs(np.cross(x, g).sum(axis=0)).max() / (scale * np.abs(x).max())
        check("gradient on rotations, relative", torque, reference=0.0, tolerance=1e-12)
    context.tell("derivatives: systems")
    for name, error in system_errors().items():
        result.check(
            f"{name} of a system, relative error",
            error,
            reference=0.0,
            tolerance=1e-7,
            params={"model": "two creases, oblique support, force"},
        )
    context.tell("derivatives: work along a path")
    coarse, _ = work_mismatch(math.radians(5.0))
    fine, states = work_mismatch(math.radians(2.5))
    result.check(
        "energy gained over work done, whole fold",
        fine,
        reference=0.0,
        tolerance=1e-4,
        params={"increment_deg": 2.5, "states": states},
    )
    result.notes.append(
        f"Energy and work over a fold from flat to 90 degrees differ by {coarse:.1e} with increments of 5 degrees and "
        f"{fine:.1e} with 2.5: what is left is the error of Simpson's rule."
    )
    return result
