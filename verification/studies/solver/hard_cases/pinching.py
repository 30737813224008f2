"""Pinches: of one crease to pi / 14 (source 5.3), and of a pleated fan until its pleats buckle together (3.5.3)."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Displace, Force, Model, Path, Sheet, State, trace
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.solvers.linear import linear_response
from verification.framework.checks import CaseResult, line, plot
from verification.studies.ch3.cone import circle_radius
from verification.studies.solver.campaign import FINE

Array = NDArray[np.float64]
PINCHED = math.pi / 14.0
LENGTH, WIDTH, ZONE = 100.0, 5.0, 10.0  # mm; the source does not say how long its pinched zone is
REACH = 3  # edges on each side of a node from which its curvature is read


# ------------------------------------------------------------------------------------ a single crease (5.3)


def pinched_crease(kappa_0: float, length: float = LENGTH, t: float = 0.5, along: int = 160) -> Model:
    """Section 5.3.2: spring crease (L* = 2 mm) with rest angle 90 degrees, then its middle closed to pi / 14.

    Only the crease edges of the pinched zone are held, so no more than their moments join the unknowns; the sheet
    itself stays free (rigid-body support).
    """
    pattern = (
        meshes.annulus_sector(1.0 / kappa_0, WIDTH, length * kappa_0)
        if kappa_0
        else meshes.strip(length, 2.0 * WIDTH, [WIDTH])
    )
    mesh = meshes.structured(pattern, along=along)
    half = max(1, round(0.5 * ZONE / length * along))
    zone = mesh.crease_edges("crease")[along // 2 - half : along // 2 + half]
    mesh = replace(
        mesh, edge_sets={**mesh.edge_sets, "crease:pinch": zone}, folds={**mesh.folds, "pinch": "mountain"}
    )
    model = Model(mesh, Sheet(E=4000.0, t=t), formulation="bars-and-hinges", contact=False).fold(
        "crease", rest=0.5 * math.pi, Lstar=2.0
    )
    return model.fold("pinch", to=PINCHED)


def crease_curvature(points: Array, reach: int = REACH) -> Array:
    """(k - 2 reach,) curvature along a polyline (k, 3), from circles through 2 reach + 1 points, 1/mm."""
    return np.array(
        [1.0 / circle_radius(points[i - reach : i + reach + 1]) for i in range(reach, len(points) - reach)]
    )


def pinch(result: CaseResult) -> None:
    """kappa_0 from 0 to 0.05 /mm; long and thin sheets too."""
    peaks = []
    series = []
    cases = [(kappa_0, LENGTH, 0.5) for kappa_0 in (0.0, 0.001, 0.005, 0.01, 0.02, 0.05)]
    for kappa_0, length, t in [*cases, (0.001, 300.0, 0.1), (0.01, 300.0, 0.1), (0.05, 100.0, 0.1)]:
        path = trace(pinched_crease(kappa_0, length, t))
        fine = trace(pinched_crease(kappa_0, length, t), strategy=FINE)
        last = path[-1]
        params = {"kappa_0_per_mm": kappa_0, "L_mm": length, "t_mm": t}
        phi = last.dihedral("crease")
        check = partial(result.check, params=params, path=path)
        check(
            "pinch: total energy",
            last.energy.total,
            unit="N mm",
            reference=fine[-1].energy.total,
            source="four times finer increments",
            tolerance=1e-7,
        )
        check(
            "pinch: smallest dihedral angle",
            phi.min(),
            unit="rad",
            reference=PINCHED,
            source="imposed (5.3.2)",
            tolerance=1e-9,
        )
        check(
            "pinch: largest difference between both halves",
            np.abs(phi - phi[::-1]).max(),
            unit="rad",
            reference=0.0,
            source="mirror symmetry",
            tolerance=1e-7,
        )
        check(
            "pinch: at most 60 iterations",
            path.iterations <= 60,
            reference=1.0,
            source="target",
            tolerance=0.0,
        )
        if t == 0.5 and kappa_0 > 0.0:
            curvature = crease_curvature(last.crease_points("crease"))
            # the source's peak lies just outside the pinched zone; inside, a held angle keeps a crest of its own
            inner = len(phi) - 2 * REACH
            u = (REACH + np.arange(inner + 1)) / len(phi)
            peaks.append((kappa_0, float(curvature[np.abs(u - 0.5) > 0.5 * ZONE / length].max())))
            series.append(line(f"kappa_0 = {kappa_0:g} /mm", u.tolist(), curvature.tolist()))
    for kappa_0, peak in peaks:
        result.check(
            "pinch: peak curvature outside the pinched zone over kappa_0",
            peak / kappa_0,
            source="source Fig. 5.6 (b): proportional to kappa_0",
            params={"kappa_0_per_mm": kappa_0},
        )
    slopes = [math.log(b[1] / a[1]) / math.log(b[0] / a[0]) for a, b in pairwise(peaks[:4])]
    result.check(
        "pinch: exponent of the peak curvature in kappa_0 up to 0.02 /mm",
        np.mean(slopes),
        reference=1.0,
        source="source Fig. 5.6 (b): proportional",
        tolerance=0.1,
    )
    result.plots.append(
        plot(
            "hard-pinch",
            "Pinched single crease",
            "u / L",
            "curvature of the crease, 1/mm",
            series,
            "Folded to 90 degrees, then its middle 10 mm closed to pi / 14 (Fig. 5.6 a).",
        )
    )


# ------------------------------------------------------------------------------------ a pleated fan (3.5.3)

PLEATS, RADIUS, PLEAT = 5, 100.0, 8.0


class Fan:
    """An annulus sector with five pleats, in the axes of its middle line: radial `er`, tangential `et`, normal z.

    As in 3.5.3 the middle line is held in the tangential direction and, where its nodes lie low, along z; its
    innermost node is also held radially. That leaves the flat sheet its turn about the line, which the rigid-body
    support takes out. `line` are the nodes of the middle line from the inner to the outer edge.
    """

    def __init__(
        self,
        along: int = 24,
        angle: float = math.pi / 4.0,
        t: float = 0.127,
        formulation: str = "bars-and-hinges",
        radius: float = RADIUS,
        rows: int = 2,
    ) -> None:
        """A fan of `along` cells and `rows` a pleat; sector angle in rad, thickness and inner radius in mm."""
        radii = [radius + PLEAT * i for i in range(PLEATS)]
        folds = ["mountain" if i % 2 == 0 else "valley" for i in range(PLEATS)]
        pattern = meshes.annulus_sector(radii, PLEAT, angle, folds)  # type: ignore[arg-type]
        self.mesh = meshes.structured(pattern, along=along, rows=rows)
        self.er = np.array([math.cos(0.5 * angle), math.sin(0.5 * angle), 0.0])
        self.et = np.array([-math.sin(0.5 * angle), math.cos(0.5 * angle), 0.0])
        places = ["edge:inner", *(f"crease:{name}" for name in self.mesh.creases), "edge:outer"]
        across = np.abs(self.mesh.points @ self.et)
        self.line = [int(nodes[np.argmin(across[nodes])]) for nodes in map(self.mesh.nodes, places)]
        model = Model(self.mesh, Sheet(E=4000.0, t=t), formulation=formulation, contact=False)
        model = model.support(self.line, [self.et.tolist()])
        model = model.support(self.line[0::2], "z").support(self.line[:1], [self.er.tolist()])
        model = model.support("rigid-body")
        self.folded = model.fold("all", by=0.5 * math.pi, Lstar=2.0)

    def pinched(self, state: State, share: float) -> Model:
        """The folded fan, then its outer edge drawn in by a share of what the fan measures across."""
        radial = (state.points[self.line] - self.mesh.points[self.line]) @ self.er
        across = float((state.points[self.line[-1]] - state.points[self.line[0]]) @ self.er)
        pull = Displace(self.line[-1:], self.er.tolist(), float(radial[-1]) - share * across)
        return self.folded.step(pull)

    def stiffness(self, model: Model, state: State) -> tuple[float, float]:
        """Stiffness (N/mm) against small forces on both ends of the middle crease: along that crease, and across it."""
        crease = self.mesh.nodes(f"crease:{self.mesh.creases[PLEATS // 2]}")
        inwards = state.points[crease[[1, -2]]] - state.points[crease[[0, -1]]]
        inwards /= np.linalg.norm(inwards, axis=1)[:, None]
        across = np.cross([0.0, 0.0, 1.0], inwards) * [[1.0], [-1.0]]
        across /= np.linalg.norm(across, axis=1)[:, None]
        found = []
        for pair in (inwards, across):
            ends = zip(crease[[0, -1]].tolist(), pair.tolist(), strict=True)
            loaded = model.step(*(Force([node], each=force) for node, force in ends))
            form = formulation(loaded.formulation)
            system = form.system(loaded, load_steps(loaded)[-1], state)
            # both ends give work 1/2 F^2 / K
            found.append(-1.0 / linear_response(system, system.start()).energy)
        return found[0], found[1]


def fan(result: CaseResult) -> None:
    """Folded to 90 degrees and pinched to a tenth of its width; axial against rotational stiffness on the way."""
    it = Fan()
    folded = trace(it.folded)
    for number, name in enumerate(it.mesh.creases):
        angle = float(folded[-1].fold_angle(name).mean())
        result.check(
            "fan: mean fold angle",
            angle,
            unit="rad",
            reference=(-1.0) ** number * 0.5 * math.pi,
            source="rest angle, L* = 2 mm",
            tolerance=0.02,
            params={"crease": name},
            path=folded,
        )
    for share in (0.5, 0.7, 0.9):
        path = trace(it.pinched(folded[-1], share), neighbours=False)
        fine = trace(it.pinched(folded[-1], share), strategy=FINE, neighbours=False)
        buckled = share > 0.8  # then there are many states with nearly the same energy
        how = "that of finer increments; 2 % is another branch" if buckled else "four times finer increments"
        result.check(
            "fan: total energy of the pinched fan",
            path[-1].energy.total,
            unit="N mm",
            reference=fine[-1].energy.total,
            source=how,
            tolerance=0.02 if buckled else 1e-6,
            params={"share": share},
            path=path,
        )
    pull = [float(s.reaction(f"node:{it.line[-1]}") @ it.er) for s in path if s.step == 1]
    falls = bool((np.diff(np.abs(pull)) < 0.0).any())
    result.check(
        "fan: pleats buckle, the pull falls on the way",
        falls,
        reference=1.0,
        source="source 3.5.3: sequential folds buckle together",
        tolerance=0.0,
        path=path,
    )
    _anisotropy(result, it, path)


def _anisotropy(result: CaseResult, it: Fan, path: Path) -> None:
    """Along the pinch: energy against the work of the pull, and the two stiffnesses of Fig. 3.11 (e, f)."""
    pinch = [(record, state) for record, state in zip(path.records, path, strict=True) if record.step == 1]
    ratios, shares = [], []
    for record, state in pinch:
        if not record.stable:
            continue
        axial, turning = it.stiffness(path.model, state)
        ratios.append(turning / axial)
        shares.append(record.lam)
    result.check(
        "fan: largest rotational over axial stiffness",
        max(ratios),
        source="source 3.5.3: axial is always greater",
        path=path,
    )
    result.check(
        "fan: axial stiffness is greater at every state",
        max(ratios) < 1.0,
        reference=1.0,
        source="source 3.5.3",
        tolerance=0.0,
        path=path,
    )
    result.check(
        "fan: rotational over axial stiffness, pinched over first",
        ratios[-1] / ratios[0],
        source="source Fig. 3.11 (f): falls, to 0.2 % at its end",
        path=path,
    )
    result.plots.append(
        plot(
            "hard-fan",
            "Pinched fan",
            "share of the pinch",
            "rotational over axial stiffness",
            [line("end of the middle crease", shares, ratios)],
            "As the fan is pinched (Fig. 3.11 f).",
            log="y",
        )
    )
