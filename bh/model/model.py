"""Description of what is to be solved: mesh, sheet, supports, creases and actuation steps. No unknowns in here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import ModelError
from bh.formulations.observables import Until
from bh.model.actuations import Actuation, Displace, Fold, Force, Moment, Pinch
from bh.model.supports import Holding, RigidBody, Support
from meshes import SheetMesh
from meshes.mesh import count
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.formulations.remarks import Remark


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A thin elastic sheet; its values are given by name: `Sheet(E=4000, nu=0.38, t=0.127)`.

    Attributes:
        E: Young's modulus, MPa.
        t: thickness, mm.
        nu: Poisson's ratio in (-1, 0.5]; bars and hinges take 0, as the source does (3.3.2).
    """

    E: float
    t: float
    nu: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("E", "MPa"), ("t", "mm")):
            value = getattr(self, name)
            if not (isinstance(value, Real) and math.isfinite(value) and float(value) > 0.0):
                raise ModelError(f"sheet {name} = {value!r} cannot be; give a positive number in {unit}")
        if not (isinstance(self.nu, Real) and -1.0 < self.nu <= 0.5):
            raise ModelError(f"sheet nu = {self.nu!r} cannot be; Poisson's ratio lies in (-1, 0.5]")

    def bending_stiffness(self, nu: float | None = None) -> float:
        """D = E t^3 / (12 (1 - nu^2)), N mm (Eq. B.2); `nu` overrides the sheet's."""
        nu = self.nu if nu is None else nu
        return self.E * self.t**3 / (12.0 * (1.0 - nu**2))


@dataclass(frozen=True)
class CreaseLaw:
    """A spring crease: moment a length = stiffness (phi - rest), N mm / mm.

    A `rest` angle that is not flat comes in during the first step, since the sheet begins flat.
    """

    Lstar: float | None = None
    stiffness: float | None = None
    rest: float = math.pi

    def __post_init__(self) -> None:
        if (self.Lstar is None) == (self.stiffness is None):
            raise ModelError("a crease needs either Lstar (mm) or stiffness (N mm / (mm rad))")
        value = self.Lstar if self.Lstar is not None else self.stiffness
        assert value is not None
        low_ok = value > 0.0 if self.Lstar is not None else value >= 0.0
        if not (math.isfinite(value) and low_ok):
            raise ModelError(
                f"crease stiffness {value} cannot be; give a positive Lstar, or a stiffness of 0 or more"
            )

    def per_length(self, sheet: Sheet) -> float:
        """Stiffness a length of crease (Eq. 3.12 with nu = 0), N mm / (mm rad)."""
        if self.stiffness is not None:
            return self.stiffness
        assert self.Lstar is not None
        return sheet.bending_stiffness(nu=0.0) / self.Lstar


@dataclass(frozen=True, eq=False)
class ElementStiffness:
    """Given stiffness of every element, in place of what the sheet would give.

    Attributes:
        bars: (e,) axial stiffness of the bar on every edge of `mesh.topology.edges`, N/mm.
        green: bars measure Green's strain, energy 1/2 k L^2 e^2 with e = (l^2 - L^2) / (2 L^2), in place of l - L.
        hinges: (m,) rotational stiffness of every hinge of `mesh.topology.hinges` (total, not a length), N mm / rad.
    """

    bars: NDArray[np.float64]
    hinges: NDArray[np.float64]
    green: bool = False

    def __post_init__(self) -> None:
        for name in ("bars", "hinges"):
            values = np.array(getattr(self, name), dtype=float)
            if not (np.isfinite(values).all() and (values >= 0.0).all()):
                raise ModelError(f"stiffness of {name} must be finite and not negative")
            values.setflags(write=False)
            object.__setattr__(self, name, values)


@dataclass(frozen=True, repr=False)
class Model:
    """A sheet with supports, creases and steps of actuation (frozen; the methods return changed copies).

    Attributes:
        mesh: the stress-free sheet.
        sheet: its material and thickness.
        supports: none at all means the rigid-body support.
        steps: each a tuple of actuations that act together (and an `Until` that ends it); steps run one after another.
        creases: laws of spring creases. A crease with no law and no fold is ordinary sheet.
        formulation: name of a registered formulation.
        stiffness: given element stiffness (bars and hinges only), or None to derive it from the sheet.
        hinge_lock: bending hinges and spring creases stop before their panels pass through each other (bars and hinges
            only): stiffening without bound within the last 2 degrees before 0 and 2 pi, nothing elsewhere.
    """

    mesh: SheetMesh
    sheet: Sheet
    supports: tuple[Holding, ...] = ()
    steps: tuple[tuple[Actuation | Until, ...], ...] = ()
    creases: Mapping[str, CreaseLaw] = field(default_factory=dict)
    formulation: str = "bars-and-hinges"
    stiffness: ElementStiffness | None = None
    hinge_lock: bool = True

    def __post_init__(self) -> None:
        for name, kind, how in (
            ("mesh", SheetMesh, "meshes.structured(pattern, aspect_ratio=8)"),
            ("sheet", Sheet, "bh.Sheet(E=4000, nu=0.38, t=0.127)"),
        ):
            value = getattr(self, name)
            if not isinstance(value, kind):
                what = (
                    f"the class {value.__name__}" if isinstance(value, type) else f"a {type(value).__name__}"
                )
                raise ModelError(
                    f"the {name} of a model is {what}; give bh.Model(mesh, sheet) {how} as {name}"
                )
        if not isinstance(self.hinge_lock, bool):
            raise ModelError(f"hinge_lock = {self.hinge_lock!r} cannot be; give True or False")

    def __repr__(self) -> str:
        """One line: "Model(384 triangles, 1 crease, 4 supports, 1 step, bars-and-hinges)"."""
        supports = count(len(self.supports), "support") if self.supports else "rigid-body support"
        creases = count(len(self.mesh.creases), "crease")
        triangles, steps = count(len(self.mesh.triangles), "triangle"), count(len(self.steps), "step")
        return f"Model({triangles}, {creases}, {supports}, {steps}, {self.formulation})"

    @classmethod
    def from_arrays(
        cls,
        points: ArrayLike,
        triangles: ArrayLike,
        bars: ArrayLike,
        bar_stiffness: ArrayLike,
        bending_hinges: ArrayLike,
        bending_stiffness: ArrayLike,
        folding_hinges: ArrayLike,
        folding_stiffness: ArrayLike,
        supports: ArrayLike = (),
        green: bool = False,
    ) -> Model:
        """A bar-and-hinge problem given as plain arrays, as other codes hand it over.

        Args:
            points: (n, 3) nodes, mm; triangles: (t, 3).
            bars: (b, 2) node pairs and their stiffness (b,), N/mm; every edge of the mesh must have one.
            bending_hinges, folding_hinges: (m, 2) or (m, 4) rows that begin with the two nodes of the edge, and their
                stiffness (m,), N mm / rad. The folding hinges become the crease "fold", at rest flat.
            supports: (s, 4) rows node, x, y, z with 1 for a direction that is held.
            green: bars measure Green's strain; see `ElementStiffness`.

        Raises:
            ModelError, MeshError: arrays that do not fit together.
        """
        mesh = SheetMesh(np.asarray(points), np.asarray(triangles))
        topology = mesh.topology
        k_bar = _on_edges(mesh, "bars", bars, bar_stiffness)
        if np.isnan(k_bar).any():
            a, b = topology.edges[int(np.argmax(np.isnan(k_bar)))]
            raise ModelError(f"edge {a}-{b} has no bar; give every edge of the triangles one")
        k_bend = _on_edges(mesh, "bending hinges", bending_hinges, bending_stiffness)
        k_fold = _on_edges(mesh, "folding hinges", folding_hinges, folding_stiffness)
        creased = np.flatnonzero(~np.isnan(k_fold))
        k_hinge = np.nan_to_num(np.where(np.isnan(k_fold), k_bend, k_fold))[topology.hinge_edges]
        if len(creased):  # an empty crease could be neither folded nor drawn
            mesh = replace(
                mesh, edge_sets={"crease:fold": topology.edges[creased]}, folds={"fold": "mountain"}
            )
        # the sheet only sets the scale of forces here; a mean bar stiffness stands for E t
        model = cls(
            mesh, Sheet(E=float(np.mean(k_bar)), t=1.0), stiffness=ElementStiffness(k_bar, k_hinge, green)
        )
        if len(creased):
            model = model.crease("fold", stiffness=1.0)
        for node, *held in np.asarray(supports, dtype=np.int64).reshape(-1, 4).tolist():
            letters = "".join(axis for axis, on in zip("xyz", held, strict=True) if on)
            if letters:
                model = model.support([node], letters)
        return model

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What the mesh does to the answer with this formulation (`bh.formulations.remarks`); empty where there is nothing to say."""
        from bh.formulations.remarks import remarks

        return remarks(self)

    def support(
        self,
        at: str | Sequence[int] | Holding,
        fix: str | Sequence[Sequence[float]] = "xyz",
        clamp: bool = False,
    ) -> Model:
        """Hold nodes, and the slope too with `clamp`; at "rigid-body" take out what rigid motions are left.

        `at` can be a support of your own. See `bh.model.supports`.
        """
        item = (
            at if isinstance(at, Holding) else RigidBody() if at == "rigid-body" else Support(at, fix, clamp)
        )
        return replace(self, supports=(*self.supports, item))

    def crease(self, name: str, **law: Any) -> Model:
        """Give a crease a spring: `Lstar` (mm) or `stiffness` (N mm / (mm rad)), and its `rest` angle (rad)."""
        self.mesh.crease_edges(name)
        return replace(self, creases={**self.creases, name: CreaseLaw(**law)})

    def step(self, *actuations: Actuation | Until, until: Until | None = None) -> Model:
        """Add a step in which all `actuations` act together; it ends before they are complete where `until` says."""
        if until is not None:
            actuations = (*actuations, until)
        if all(isinstance(item, Until) for item in actuations):
            raise ModelError("a step needs at least one actuation (fold, pinch, moment, force or displace)")
        if sum(isinstance(item, Until) for item in actuations) > 1:
            raise ModelError("a step has two targets to end at (until); give it one")
        return replace(self, steps=(*self.steps, actuations))

    def fold(self, crease: str, until: Until | None = None, **how: Any) -> Model:
        """Add a step that folds a crease; arguments of `bh.Fold`."""
        return self.step(Fold(crease, **how), until=until)

    def pinch(self, crease: str, until: Until | None = None, **how: Any) -> Model:
        """Add a step that pinches a crease that is folded already; arguments of `bh.Pinch`.

        With how="couple" it ends where the angle is reached, on the first crease of the sheet if `crease` is "all".
        """
        item = Pinch(crease, **how)
        if item.how == "couple" and until is None:
            on = crease if crease != "all" else next(iter(self.mesh.creases), crease)
            until = Until("largest_fold", item.fold, of=on)
        return self.step(item, until=until)

    def moment(self, crease: str, to: float) -> Model:
        """Add a step with a couple a length on a crease; see `bh.Moment`."""
        return self.step(Moment(crease, to))

    def force(self, at: str | Sequence[int], **how: Any) -> Model:
        """Add a step with dead forces; arguments of `bh.Force`."""
        return self.step(Force(at, **how))

    def displace(self, at: str | Sequence[int], direction: str | Sequence[float], by: float) -> Model:
        """Add a step with prescribed displacements; see `bh.Displace`."""
        return self.step(Displace(at, direction, by))


def _on_edges(mesh: SheetMesh, what: str, rows: ArrayLike, values: ArrayLike) -> NDArray[np.float64]:
    """(e,) values of the edges that `rows` begin with, nan elsewhere."""
    pairs = np.asarray(rows, dtype=np.int64)
    stiffness = np.asarray(values, dtype=float)
    out: NDArray[np.float64] = np.full(len(mesh.topology.edges), np.nan)
    if pairs.size == 0:
        return out
    if pairs.ndim != 2 or pairs.shape[1] < 2 or stiffness.shape != (len(pairs),):
        raise ModelError(
            f"{what}: {pairs.shape} rows do not fit {stiffness.shape} stiffness values; give one a row"
        )
    if not (np.isfinite(stiffness).all() and (stiffness >= 0.0).all()):
        raise ModelError(f"stiffness of {what} must be finite and not negative; mend its values")
    edges: Ints = mesh.topology.find_edges(pairs[:, :2])
    if len(np.unique(edges)) != len(edges):
        raise ModelError(f"{what}: an edge is named twice; give every edge one stiffness")
    out[edges] = stiffness
    return out
