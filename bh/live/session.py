"""A sheet under a hand: takes changes, gives the newest equilibrium within a budget of time."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.live.controls import CLOSED, Controls, Way, fold_of
from bh.live.floating import Floating
from bh.live.frame import Frame
from bh.live.grips import Grip, Jaws, Vector
from bh.live.history import Mark, lightened
from bh.live.holding import drawn_folds, handled, held
from bh.live.laying import Laying
from bh.model.actuations import Pull
from bh.model.model import Model
from bh.model.step import Actuation, Step
from bh.runtime.threads import one_blas_thread
from bh.solvers.load_control import LoadControl
from bh.solvers.points import Point
from meshes import SheetMesh
from meshes.mesh import count

Array = NDArray[np.float64]
REMEMBERED = 1000  # states at rest that `undo` can go back to
GRIP = 200.0  # stiffness of a grip in parts of D / L^2, of a panel as large as the sheet: it gives way, yet leads
JAWS = (
    10.0  # stiffness of the spring of a jaw in parts of that of a grip: the gap is nearly that of the nodes
)


class Session:
    """A sheet that answers while it is handled.

    A crease that is a spring in the model turns its rest angle, the others are imposed. The steps of the model are
    not followed: the sheet begins flat, or folded as its mesh is. Without supports it is held at three nodes in its
    middle, which takes the rigid motions and nothing else.
    """

    def __init__(self, model: Model, settings: LoadControl | None = None, settles: bool = False) -> None:
        """Begin flat, or as it is drawn, and at rest.

        Args:
            model: sheet, supports and creases.
            settings: increments and tolerances; None for the driver's own.
            settles: it is a net of springs: where a branch ends it moves downhill to rest, as `bh.Settling` does.

        Raises:
            ModelError: the sheet cannot be solved as described.
        """
        if model.remembers:
            what = "friction remembers its" if model.rubs else "creases that yield remember their"
            raise ModelError(f"{what} way; fold the sheet by bh.trace or bh run")
        self.model = replace(model if model.supports else held(model), steps=())
        self._free = (
            held(replace(self.model, supports=())).supports == self.model.supports
        )  # but for its middle
        self._floating = Floating()
        self._laying = Laying(self.model, settings or LoadControl(), settles)
        self._wanted = Controls(drawn_folds(self.mesh, handled(self.mesh)))
        self._gone: tuple[int, ...] = ()
        self._past: list[Mark] = []
        self._undone: list[Mark] = []
        self._iterations = 0
        self._left = False
        self._ways = 0  # that it began behind the one on which it stands at first, and turns on them
        self._seen: tuple[Array, State] | None = None  # the newest state, and the unknowns that it belongs to
        self._under = self._laying.begin(self._wanted, self._wanted)

    # ------------------------------------------------------------------------------- what a hand does

    @property
    def mesh(self) -> SheetMesh:
        """Of the sheet."""
        return self.model.mesh

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self._under.system.size

    @property
    def left(self) -> bool:
        """Whether it has snapped since the session began, or lies on another branch (`leave`): a run may end elsewhere.

        A way back does not take that away, `undo` and `go_back` do.
        """
        return self._left

    @property
    def straight(self) -> bool:
        """Whether it only went on from flat along one line of fold angles, without a snap, as a run from flat does.

        One that was folded and pulled at once is not: a run folds first.
        """
        both = bool(self._wanted.grips) and any(self._wanted.folds.values())
        return self._ways <= 1 and not self._left and not both

    def leave(self, state: State) -> None:
        """Note that a run from flat ends on another branch than a state; not where another one is the newest now.

        Args:
            state: of a frame, which such a run was compared with.
        """
        seen = self._seen
        if seen is not None and seen[1] is state and seen[0] is self._under.march.here.q:
            self._left = True

    @property
    def newest(self) -> Point:
        """The newest state in the solver's terms."""
        return self._under.march.here

    @property
    def wanted(self) -> Controls:
        """What is asked for."""
        return self._wanted

    @property
    def controls(self) -> Controls:
        """What the newest state is in equilibrium with: `wanted` at rest, else what it has come to."""
        return self._now()

    @property
    def creases(self) -> tuple[str, ...]:
        """Creases that can be folded."""
        return tuple(self._wanted.folds)

    def fold(self, crease: str, angle: float) -> None:
        """Ask for a fold angle.

        Args:
            crease: its name, or "all".
            angle: fold angle, rad, positive the way that the crease is drawn; held inside a hair of closing.

        Raises:
            ModelError: no such crease, or no number.
        """
        if crease != "all" and crease not in self._wanted.folds:
            known = ", ".join(self.creases) or "none"
            raise ModelError(f"there is no crease '{crease}' to fold; choose one of {known}, or 'all'")
        if not math.isfinite(angle):
            raise ModelError(f"fold of crease '{crease}' by {angle} cannot be; give a number of rad")
        angle = min(max(angle, -CLOSED), CLOSED)
        folds = {name: angle if crease in (name, "all") else old for name, old in self._wanted.folds.items()}
        self._ask(replace(self._wanted, folds=folds))

    def pull(self, node: int, to: Vector, stiffness: float | None = None) -> None:
        """Pull a node to a point by a spring.

        Args:
            node: of the mesh.
            to: (3,) the point, mm.
            stiffness: of the spring, N/mm; None for one that suits the sheet.

        Raises:
            ModelError: no such node, no point, or no stiffness.
        """
        if not 0 <= node < len(self.mesh.points):
            raise ModelError(
                f"there is no node {node} to pull; choose one of 0 to {len(self.mesh.points) - 1}"
            )
        if len(to) != 3 or not all(math.isfinite(x) for x in to):
            raise ModelError(f"node {node} cannot be pulled to {to}; give three numbers of mm")
        old = self._wanted.grips.get(node)
        given = (old.stiffness if old else self._soft) if stiffness is None else stiffness
        x, y, z = (float(c) for c in to)
        self._ask(self._wanted.gripped({node: Grip((x, y, z), given)}))

    def pinch(self, a: int, b: int, gap: float | None = None, stiffness: float | None = None) -> None:
        """Squeeze two nodes together between jaws, which move along the line between them.

        The line is that between the nodes when they are pinched first; `let_go` opens the jaws.

        Args:
            a: a node of the mesh.
            b: another one.
            gap: between the jaws, mm; None to touch the nodes where they are, without a force.
            stiffness: of the spring of each jaw, N/mm; None for one that suits the sheet.

        Raises:
            ModelError: no such node, both at one point, no gap, or no stiffness.
        """
        if gap is not None and not (math.isfinite(gap) and gap >= 0.0):
            raise ModelError(
                f"a pinch with a gap of {gap} mm cannot be; give a number of mm that is not negative"
            )
        jaws = next((old for old in self._wanted.jaws if (old.a, old.b) == (a, b)), None)
        if jaws is None:
            points = self._state().points
            jaws = Jaws.on(points, a, b, JAWS * self._soft if stiffness is None else stiffness)
            gap = float(np.linalg.norm(points[b] - points[a])) if gap is None else gap
        if gap is not None:
            self._ask(self._wanted.gripped(jaws.grips(gap), jaws))

    def let_go(self, node: int | None = None) -> None:
        """Let go of a node, or of all of them; what pulled fades out."""
        self._ask(self._wanted.without(node))

    def undo(self) -> bool:
        """Go back to where the sheet last was at rest with something else; False if there is nothing."""
        while self._past and self._past[-1].controls == self._wanted:
            self._past.pop()
        if not self._past:
            return False
        undone = lightened([*self._undone, self.mark()], REMEMBERED)
        self.go_back(self._past.pop())
        self._undone = undone
        return True

    def redo(self) -> bool:
        """Take the last `undo` back; False if there is none, or something else was asked for since."""
        if not self._undone:
            return False
        left, there = self._undone[:-1], self._undone[-1]
        self.go_back(there)
        self._undone = left
        return True

    def mark(self) -> Mark:
        """Where it is, for `go_back`: what is asked for, and the state if it is at rest with that."""
        here = self._under.march.here
        if self._now() != self._wanted or self._under.fading or self._under.march.unseen:
            return Mark(self._wanted, None, self._left, self._ways)
        return Mark(self._wanted, here.q, self._left, self._ways)

    def go_back(self, there: Mark) -> None:
        """Ask for what was asked for then, and lie as the sheet lay then; where that is not known it goes there.

        Args:
            there: of a session of the same model.
        """
        self._ask(there.controls)
        if there.q is None:
            return
        flat = replace(there.controls, folds=dict.fromkeys(there.controls.folds, 0.0))
        under = self._laying.back(Way(flat, there.controls), there.q, 0)
        if under is not None:
            self._iterations += self._under.march.iterations
            self._under, self._gone, self._left = under, (), there.left
            self._ways = there.ways

    def ask(self, wanted: Controls) -> None:
        """Ask for all controls at once, such as those of another session of the same sheet.

        Raises:
            ModelError: a crease or node is not there.
        """
        for name, angle in wanted.folds.items():
            self.fold(name, angle)
        for node, grip in wanted.grips.items():
            self.pull(node, grip.to, grip.stiffness)
        self._ask(replace(self._wanted, jaws=wanted.jaws))

    # ------------------------------------------------------------------------------- what it answers

    def update(self, budget: float = 0.03) -> Frame:
        """The newest equilibrium after about `budget` of work, which ends behind the iteration in hand.

        Args:
            budget: s of wall time, one iteration at least; 0 for no work.

        Returns:
            a frame; `at_rest` says whether it is that of what is wanted. Whether a state is stable is looked at once
            nothing else is wanted, by the next update: the frame is there before.
        """
        began = time.perf_counter()
        snapped = False
        with one_blas_thread():
            self._aim()
            march = self._under.march
            going = budget > 0.0  # one iteration at least, however little time there is
            worked = False
            while going and (self._busy() or (not worked and self._under.march.look())):
                worked, march = True, self._under.march
                snapped = snapped or march.snapped
                going = time.perf_counter() - began < budget
            snapped = snapped or march.snapped
            self._left = self._left or snapped
            march.snapped = False
            frame = self._frame(snapped, time.perf_counter() - began)
        if frame.at_rest and (not self._past or self._past[-1].controls != self._wanted):
            self._past = lightened([*self._past, self.mark()], REMEMBERED)
        return frame

    def rest(self, most: float = 60.0) -> Frame:
        """The equilibrium of what is wanted, or where the sheet cannot go on.

        Args:
            most: s of wall time.
        """
        ends = time.perf_counter() + most
        frame = self.update(most)
        while not frame.at_rest and not frame.note and time.perf_counter() < ends:
            before = frame
            frame = self.update(ends - time.perf_counter())
            seconds = before.seconds + frame.seconds
            frame = replace(frame, snapped=before.snapped or frame.snapped, seconds=seconds)
        return frame

    def imbalance(self) -> float:
        """Forces of the newest state that are out of balance, computed anew.

        Returns:
            the largest over the typical force of an element, as of `bh.solvers.system.Evaluation`.
        """
        here = self._under.march.here
        return self._under.system.evaluate(here.q, here.lam).imbalance

    def scene(self) -> Model:
        """The model whose steps lead straight to what is wanted: one that folds, one that pulls.

        Returns:
            a model for `bh.trace`; where the sheet has `left` its branch on its way here, it may end on another one.
            Panels pass through each other in it where they do so here, which a run would else look for.
        """
        folds = tuple(fold_of(self.model, name, angle) for name, angle in self._wanted.folds.items())
        pulls: tuple[Actuation, ...] = tuple(
            Pull(node, grip.to, grip.stiffness) for node, grip in self._wanted.grips.items()
        )
        steps = [Step(items) for items in (folds, pulls) if items]
        contact = self.model.contact if self.model.stops_itself else False
        return replace(self.model, contact=contact, steps=tuple(steps))

    # ------------------------------------------------------------------------------- its own

    @property
    def _soft(self) -> float:
        """Stiffness of a grip that suits the sheet, N/mm."""
        size = float(np.ptp(self.mesh.points, axis=0).max())
        return GRIP * self.model.sheet.bending_stiffness(nu=0.0) / size**2

    def _ask(self, wanted: Controls) -> None:
        if wanted != self._wanted:
            self._wanted, self._undone = wanted, []
            self._under.march.stuck = ""
            self._floating.again()

    def _busy(self) -> bool:
        """One iteration more; False where there is nothing left to do."""
        if self._under.march.advance():
            return True
        if self._under.march.stuck:
            return False
        if self._now() == self._wanted and not self._under.fading:
            points = self._state().points if self._floats else None
            if points is None or not self._floating.due(self._wanted, points):
                return False
            self._wanted = self._floating.moved(self._wanted, points)
        self._aim()
        return self._under.march.advance()

    def _aim(self) -> None:
        """Let the march in hand, or a new one from its newest state, go to what is wanted."""
        under = self._under
        if under.march.stuck:
            return
        if (lam := under.lam_of(self._wanted)) is not None:
            back = abs(lam) < abs(under.march.target) or lam * under.march.target < 0.0
            self._ways += back  # past a place where branches meet it may come to another one
            under.march.target = lam
            return
        now = self._now()
        self._iterations += under.march.iterations
        state = self._state()
        self._laying.stop(under, state)
        self._release(now, state)
        grips = {}
        for node, grip in self._wanted.grips.items():
            at = state.points[node]
            x, y, z = at.tolist()
            old = now.grips.get(node, Grip((x, y, z), grip.stiffness))  # a new one begins without a force
            grips[node] = old.stiffened(grip.stiffness, at)
        start = Controls(now.folds, grips, self._wanted.jaws)
        self._ways += 1
        self._under = self._laying.begin(start, self._wanted, state, self._gone, under.march.unseen)

    @property
    def _floats(self) -> bool:
        """Whether nothing but jaws acts on the sheet, which are moved until both press alike."""
        jawed = {node for jaws in self._wanted.jaws for node in (jaws.a, jaws.b)}
        return self._free and bool(jawed) and jawed == self._wanted.grips.keys()

    def _release(self, now: Controls, state: State) -> None:
        """Nodes that are let go of keep their force as a dead one, which the next way fades out.

        A node that was caught again while it faded has both: the force of its grip and what is left of the dead one.
        """
        forces = self._forces(now, state)
        under = self._under
        left = under.load.force.at(under.march.here.lam)
        gone = [node for node in now.grips if node not in self._wanted.grips]
        if gone:
            self._laying.keep({node: (left[node] + forces[node]).tolist() for node in gone})
        still = [node for node in self._gone if under.fading]  # what has faded out is forgotten
        self._gone = tuple(dict.fromkeys([*still, *gone]))

    def _now(self) -> Controls:
        """What the newest state is in equilibrium with."""
        under = self._under
        if under.march.here.lam == under.lam_of(self._wanted) and not under.fading:
            return self._wanted  # to the last digit
        return under.way.at(under.march.here.lam)

    def _state(self) -> State:
        under, here = self._under, self._under.march.here
        stable = None if under.march.unseen and here.negative is None else here.negative in (None, 0)
        if self._seen is None or self._seen[0] is not here.q:
            state = self._laying.formulation.observe(self.model, under.system, here.q, here.lam, 0, stable)
            self._seen = here.q, state
        elif self._seen[1].stable is not stable:
            self._seen = here.q, replace(self._seen[1], stable=stable)
        return self._seen[1]

    def _forces(self, now: Controls, state: State) -> dict[int, Vector]:
        found: dict[int, Vector] = {}
        for node, grip in now.grips.items():
            x, y, z = (grip.stiffness * (np.array(grip.to) - state.points[node])).tolist()
            found[node] = (x, y, z)
        return found

    def _frame(self, snapped: bool, seconds: float) -> Frame:
        state, now = self._state(), self._now()
        iterations = self._iterations + self._under.march.iterations
        uneven = self._floats and now == self._wanted and self._floating.due(now, state.points)
        return Frame(
            state,
            now,
            self._wanted,
            self._forces(now, state),
            snapped,
            self._under.march.stuck,
            iterations,
            seconds,
            self._under.fading or uneven,
            not self._under.march.unseen,
        )

    def __repr__(self) -> str:
        """One line: "Session(1 crease, 1 grip, 722 unknowns)"."""
        grips, creases = count(len(self._wanted.grips), "grip"), count(len(self.creases), "crease")
        return f"Session({creases}, {grips}, {self._under.system.size:,} unknowns)"
