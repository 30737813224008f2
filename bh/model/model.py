"""Description of what is to be solved: mesh, sheet, supports, creases and actuation steps. No unknowns in here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import ModelError
from bh.model.actuations import Displace, Fold, Force, Moment
from bh.model.crease_law import CreaseLaw
from bh.model.mould import Mould, check_friction
from bh.model.moving import legs
from bh.model.pinch import Pinch
from bh.model.sheet import ElementStiffness, Sheet
from bh.model.springs import GroundSpring
from bh.model.step import Actuation, Step
from bh.model.supports import Constraint, Hold, RigidBody, Support
from bh.model.until import Until
from bh.model.wide_crease import strip
from bh.model.zones import Sections, SheetZone, changed, sections
from bh.runtime.consent import said
from meshes import SheetMesh
from meshes.mesh import count
from meshes.topology import Ints

Contact = float | Literal["thickness", "auto", False]
Place = str | Sequence[int]
OF_GIVEN_STIFFNESS: str = "bars-and-hinges"  # no other formulation has elements to which it could be given


@dataclass(frozen=True, repr=False)
class Model:
    """A sheet with supports, creases and steps of actuation (frozen; the methods return changed copies).

    Attributes:
        mesh: the stress-free sheet.
        sheet: its material and thickness.
        supports: none at all means the rigid-body support.
        steps: actuations that act together, and what ends them early; steps run one after another.
        creases: laws of spring creases. A crease with no law and no fold is ordinary sheet.
        formulation: name of a registered formulation. "consistent" converges to the theory of thin sheets;
            "bars-and-hinges" is the source's.
        stiffness: given element stiffness (bars and hinges only), or None to derive it from the sheet.
        hinge_lock: bending hinges and spring creases stop before their panels pass through each other (bars and hinges
            only): stiffening without bound within the last 2 degrees before 0 and 2 pi, nothing elsewhere.
        contact: panels that share no node stop each other: "auto" (by their thickness, from where they meet in a path
            that is solved without at first), "thickness" (their middle surfaces stay the sheet's thickness apart in
            every state), a gap in mm, or False (they pass through each other: `bh.contact.first_contact` tells).
        friction: coefficient of Coulomb's friction where panels press on each other, and where bodies press that have
            none of their own; 0 for none.
        zones: parts of the sheet that are made of something else.
        springs: to the ground, in all steps; they carry the sheet beside its supports, or alone.
    """

    mesh: SheetMesh
    sheet: Sheet
    supports: tuple[Constraint, ...] = ()
    steps: tuple[Step, ...] = ()
    creases: Mapping[str, CreaseLaw] = field(default_factory=dict)
    formulation: str = "consistent"
    stiffness: ElementStiffness | None = None
    hinge_lock: bool = True
    contact: Contact = "auto"
    zones: tuple[SheetZone, ...] = ()
    springs: tuple[GroundSpring, ...] = ()
    friction: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
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
        for zone in self.zones:
            if not isinstance(zone, SheetZone):
                raise ModelError(
                    f"a zone of a model is a {type(zone).__name__}; give bh.SheetZone(where, sheet)"
                )
        if any(sheet.directed for sheet in self.sections.sheets) and not drawn_flat(self.mesh):
            raise ModelError(
                "the grain is a direction in the drawing, so the stress-free sheet must lie in z = const with its "
                "triangles counter-clockwise; unfold it first, or give a sheet without a grain"
            )
        for step in self.steps:
            if not isinstance(step, Step):
                raise ModelError(
                    f"a step of a model is a {type(step).__name__}; give bh.Step, or use model.step(...)"
                )
        if ":" in self.formulation:
            said(self.formulation)
        if not isinstance(self.hinge_lock, bool):
            raise ModelError(f"hinge_lock = {self.hinge_lock!r} cannot be; give True or False")
        gap = self.contact
        number = isinstance(gap, int | float) and not isinstance(gap, bool) and 0.0 < gap < math.inf
        if not (number or gap is False or gap in ("thickness", "auto")):
            raise ModelError(f"contact = {gap!r} cannot be; give 'thickness', 'auto', a gap in mm, or False")
        check_friction(self.friction, "model")

    @property
    def sections(self) -> Sections:
        """What every triangle is made of."""
        return sections(self.mesh, self.sheet, self.zones)

    @property
    def stops_itself(self) -> bool:
        """Do panels stop each other in every state? Not with "auto", which asks for another model once they meet."""
        return self.contact is not False and self.contact != "auto"

    @property
    def rubs(self) -> bool:
        """Is there friction where something presses, in any step?"""
        own = (getattr(item, "friction", None) for step in self.steps for item in step.actuations)
        return self.friction > 0.0 or any(each is not None and each > 0.0 for each in own)

    @property
    def hindered(self) -> bool:
        """Does something stand in the way of the sheet: panels that stop each other, or a mould?"""
        return self.stops_itself or any(isinstance(item, Mould) for s in self.steps for item in s.actuations)

    @property
    def remembers(self) -> bool:
        """Does a state depend on the way to it: creases that yield, or friction?"""
        return self.rubs or any(c.law is not None and c.law.remembers for c in self.creases.values())

    def __repr__(self) -> str:
        """One line: "Model(384 triangles, 1 crease, 4 supports, 1 step, consistent)"."""
        supports = count(len(self.supports), "support") if self.supports else "rigid-body support"
        creases = count(len(self.mesh.drawn_creases), "crease")
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
            points: (n, 3) nodes, mm.
            triangles: (t, 3) nodes of the triangles.
            bars: (b, 2) node pairs; every edge of the mesh must have one.
            bar_stiffness: (b,) their stiffness, N/mm.
            bending_hinges: (m, 2) or (m, 4) rows that begin with the two nodes of the edge.
            bending_stiffness: (m,) their stiffness, N mm / rad.
            folding_hinges: as `bending_hinges`; they become the crease "fold", at rest flat.
            folding_stiffness: (m,) their stiffness, N mm / rad.
            supports: (s, 4) rows node, x, y, z with 1 for a direction that is fixed.
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
            mesh,
            Sheet(E=float(np.mean(k_bar)), t=1.0),
            formulation=OF_GIVEN_STIFFNESS,
            stiffness=ElementStiffness(k_bar, k_hinge, green),
        )
        if len(creased):
            model = model.crease("fold", stiffness=1.0)
        for node, *fixed in np.asarray(supports, dtype=np.int64).reshape(-1, 4).tolist():
            letters = "".join(axis for axis, on in zip("xyz", fixed, strict=True) if on)
            if letters:
                model = model.support([node], letters)
        return model

    def support(
        self,
        at: str | Sequence[int] | Constraint,
        fix: str | Sequence[Sequence[float]] = "xyz",
        clamp: bool = False,
    ) -> Model:
        """Hold nodes, and the slope too with `clamp`; at "rigid-body" take out what rigid motions are left.

        `at` can be a support of your own. See `bh.model.supports`.

        Args:
            at: name of a place, node indices, or a support of your own.
            fix: letters of x, y, z, or directions (k, 3) of any length.
            clamp: hold the slope too.
        """
        item = (
            at
            if isinstance(at, Constraint)
            else RigidBody()
            if at == "rigid-body"
            else Support(at, fix, clamp)
        )
        return replace(self, supports=(*self.supports, item))

    def spring(self, at: Place, **stiffness: Sequence[float]) -> Model:
        """Let nodes rest on springs; arguments of `bh.GroundSpring`.

        Args:
            at: name of a place, or node indices.
            **stiffness: `each` or `total` (3,), N / mm, or `per_area` (3,), N / mm^3.
        """
        return replace(self, springs=(*self.springs, GroundSpring(at, **stiffness)))

    def crease(self, name: str, **law: Any) -> Model:
        """Give a crease a spring: `Lstar` (mm) or `stiffness` (N mm / (mm rad)), and its `rest` angle (rad).

        Args:
            name: of the crease.
            **law: `Lstar` (mm) or `stiffness` (N mm / (mm rad)), and `rest` (rad).

        Raises:
            MeshError: there is no such crease.
        """
        self.mesh.crease_edges(name)
        return replace(self, creases={**self.creases, name: CreaseLaw(**law)})

    def zone(
        self,
        where: str | Sequence[str] | Sequence[Sequence[float]],
        sheet: Sheet | None = None,
        stiff: float = 1.0,
        **values: float | str | None,
    ) -> Model:
        """Make a part of the sheet of something else; what is not given is that of the sheet.

        Args:
            where: "face:X,Y", "inside:PLACE", "layer:NAME", "all", several, or a polygon: see `bh.SheetZone`.
            sheet: its material and thickness.
            stiff: factor of all moduli; 1000 for a panel that is as good as rigid.
            **values: of `bh.Sheet`, such as t = 0.6.

        Raises:
            ModelError: no triangle lies there, or another zone does; one line.
        """
        made = changed(self.sheet if sheet is None else sheet, stiff, **values)
        return replace(self, zones=(*self.zones, SheetZone(where, made)))

    def wide_crease(
        self,
        name: str,
        Lstar: float | str | None = None,
        stiffness: float | str | None = None,
        sheet: Sheet | None = None,
        stiff: float = 1.0,
        **values: float | str | None,
    ) -> Model:
        """Say what the strip of a wide crease (`meshes.wide_creases`) is made of; arguments of `bh.SheetZone` beside.

        Args:
            name: of the crease.
            Lstar: of the sharp crease that it stands for, mm: the material around it, as thin as it takes. Zones that
                it lies in come before it.
            stiffness: the same, N mm / (mm rad).
            sheet: the strip's material and thickness, instead of the model's.
            stiff: factor of the moduli.
            **values: of `bh.Sheet`, such as t = 0.1.

        Raises:
            ModelError: there is no such strip, or it is told twice or not at all; one line.
        """
        made = strip(self.mesh, name, self.sheet, Lstar, stiffness, sheet, stiff, self.zones, **values)
        return replace(self, zones=(*self.zones, made))

    def step(
        self,
        *actuations: Actuation,
        until: Until | None = None,
        support: Constraint | Sequence[Constraint] = (),
        release: Place | Constraint | Sequence[Place | Constraint] = (),
        hold: Place | Sequence[Place] = (),
    ) -> Model:
        """Add a step in which all `actuations` act together; it ends before they are complete where `until` says.

        Args:
            *actuations: that act together.
            until: ends the step early; None for never.
            support: comes in when the step begins, and stays: nodes and clamped slopes are held where they are then.
            release: is let go of then: places of supports or of prescribed displacements, or supports themselves. Their
                forces go to zero during the step.
            hold: places that are clamped as they lie: all directions, and the slope at edges of the boundary.
        """
        comes = (support,) if isinstance(support, Constraint) else tuple(support)
        goes = (release,) if isinstance(release, Constraint) else _places(release)
        held = tuple(Hold(each) for each in _places(hold) if not isinstance(each, Constraint))
        return replace(self, steps=(*self.steps, Step(actuations, until, (*comes, *held), goes)))

    def fold(self, crease: str, until: Until | None = None, **how: Any) -> Model:
        """Add a step that folds a crease; arguments of `bh.Fold`.

        Args:
            crease: its name, or "all".
            until: ends the step early; None for never.
            **how: `to` or `by` (rad), and what else `bh.Fold` takes.
        """
        return self.step(Fold(crease, **how), until=until)

    def pinch(self, crease: str, until: Until | None = None, **how: Any) -> Model:
        """Add a step that pinches a crease that is folded already; arguments of `bh.Pinch`.

        With how="couple" it ends where the angle is reached, on the first crease of the sheet if `crease` is "all".

        Args:
            crease: its name, or "all".
            until: ends the step early; None for never.
            **how: arguments of `bh.Pinch`.
        """
        item = Pinch(crease, **how)
        if item.how == "couple" and until is None:
            on = crease if crease != "all" else next(iter(self.mesh.creases), crease)
            until = Until("largest_fold", item.fold, of=on)
        return self.step(item, until=until)

    def moment(self, crease: str, to: float | str) -> Model:
        """Add a step with a couple a length on a crease; see `bh.Moment`.

        Args:
            crease: its name, or "all".
            to: couple a length at the end of the step, N mm / mm; positive folds the way that the crease is drawn.
        """
        return self.step(Moment(crease, to))

    def force(self, at: str | Sequence[int], **how: Any) -> Model:
        """Add a step with dead forces; arguments of `bh.Force`.

        Args:
            at: name of a place, or node indices.
            **how: `total` or `each` (3,), N, as `bh.Force` takes them.
        """
        return self.step(Force(at, **how))

    def displace(
        self,
        at: str | Sequence[int],
        direction: str | Sequence[float],
        by: float | str | None = None,
        further: float | str | None = None,
    ) -> Model:
        """Add a step with prescribed displacements; see `bh.Displace`.

        Args:
            at: name of a place, or node indices.
            direction: x, y or z, or a vector (3,) of any length.
            by: displacement along it at the end of the step, mm from the stress-free position.
            further: the same from where the node is when the step begins, mm; in place of `by`.
        """
        return self.step(Displace(at, direction, by, further))

    def move(self, at: str | Sequence[int], along: Sequence[Sequence[float]]) -> Model:
        """Add steps that move a place along a path of straight legs, all its nodes alike; see `bh.model.moving.legs`.

        Args:
            at: name of a place, or node indices.
            along: (k, 3) corners of the path, mm from where each node is when it begins.
        """
        return replace(self, steps=(*self.steps, *legs(at, along)))


def _places(given: Place | Sequence[Place | Constraint]) -> tuple[Place | Constraint, ...]:
    """One place, or several: a list of numbers is one of nodes."""
    if isinstance(given, str):
        return (given,)
    if len(given) and all(isinstance(each, int | np.integer) for each in given):
        return (tuple(int(each) for each in given),)  # type: ignore[arg-type]
    return tuple(each if isinstance(each, str | Constraint) else tuple(each) for each in given)  # type: ignore[arg-type]


def drawn_flat(mesh: SheetMesh) -> bool:
    """Whether a mesh lies in a plane z = const (to 1e-9 of its size), its triangles counter-clockwise from +z.

    Args:
        mesh: of the stress-free sheet.
    """
    corner = mesh.points[mesh.triangles]
    up = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, 2]
    return bool(np.ptp(mesh.points[:, 2]) <= 1e-9 * mesh.size and (up > 0.0).all())


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
