"""What a design is asked for: a point, the direction of its end, points on the way of the pinch, and room for others.

Everything that is to be met is a vector of residuals (mm), so that candidates are polished for all of it at once.
Directions count as much as a lever of `LEVER` would move.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.along import along, along_strip
from bh.applications.inverse.boxes import depths
from bh.applications.inverse.converged import SHARE
from bh.applications.inverse.descent import descend
from bh.applications.inverse.forward import Forward
from bh.applications.inverse.problems import Design, ReachPoint
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.self_intersection import Swept
from bh.applications.inverse.simulate import Landing
from bh.applications.inverse.tolerances import predicted

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
LEVER = 100.0  # mm
STEADY = 0.3  # weight of movements beside residuals, where a design is to move less


@dataclass(frozen=True, eq=False)
class Stop:
    """Where a point of the crease is when pinches are closed by a part of the way.

    Attributes:
        part: of the way from the fold to the full pinch, above 0; at the end of the crease below 1.
        point: (3,) where it is to be then, mm.
        along: which point of the crease: a share of its length, 1 for its end.
    """

    part: float
    point: Array
    along: float = 1.0


@dataclass(frozen=True, eq=False)
class Wants:
    """All that is asked of a design.

    Attributes:
        point: (3,) where the crease ends, mm.
        tangent: (3,) unit vector along which it ends, or None for any.
        up: (3,) unit vector at right angles to it to which the ridge of the fold points there, or None for any.
        stops: points on the way there while all pinches are closed alike.
        keep_out: (k, 2, 3) boxes that the strip stays out of, folded and pinched, by their lowest and highest
            corners, mm.
    """

    point: Array
    tangent: Array | None = None
    up: Array | None = None
    stops: tuple[Stop, ...] = ()
    keep_out: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))

    @classmethod
    def of(
        cls,
        point: ArrayLike,
        tangent: ArrayLike | None = None,
        up: ArrayLike | None = None,
        stops: Sequence[tuple[float, ArrayLike] | tuple[float, ArrayLike, float]] = (),
        keep_out: ArrayLike = (),
    ) -> Wants:
        """From plain numbers, checked.

        Args:
            point: (3,), mm.
            tangent: (3,) of any length.
            up: (3,) of any length; only its part at right angles to the tangent counts.
            stops: parts of the way of the pinch, points (3,), mm, and of the length of the crease, 1 if not given.
            keep_out: (k, 2, 3) or (k, 6) corners of boxes, mm.

        Raises:
            DesignError: no point, no direction, a part that is none, or a box without room.
        """
        at = _vector(point, "the target")
        if up is not None and tangent is None:
            raise DesignError("a target with up needs a tangent, too; give both directions")
        along = None if tangent is None else _unit(_vector(tangent, "the tangent"), "the tangent")
        ridge = None
        if up is not None and along is not None:
            ridge = _vector(up, "up")
            ridge = _unit(ridge - (ridge @ along) * along, "up, at right angles to the tangent,")
        met = tuple(_stop(*stop) for stop in stops)
        try:
            boxes = np.asarray(keep_out, dtype=float).reshape(-1, 2, 3)
        except ValueError as error:
            raise DesignError(
                "keep_out needs boxes of six numbers: x, y, z of two opposite corners"
            ) from error
        boxes = np.sort(boxes, axis=1)
        if not np.isfinite(boxes).all() or (boxes[:, 0] >= boxes[:, 1]).any():
            raise DesignError("a box of keep_out has no room; give two opposite corners")
        places = [
            ("the start of the crease", np.zeros(3)),
            ("the target", at),
            *(("a stop", s.point) for s in met),
        ]
        for name, place in places:
            if ((boxes[:, 0] < place) & (place < boxes[:, 1])).all(axis=1).any():
                raise DesignError(
                    f"{name} ({place[0]:g}, {place[1]:g}, {place[2]:g}) lies in a box of keep_out; move the box"
                )
        return cls(at, along, ridge, met, boxes)

    @property
    def directed(self) -> bool:
        """Whether a direction is asked for."""
        return self.tangent is not None

    def turn(self, frames: Array) -> Array:
        """(..., 3) or (..., 0) residuals of the direction of frames (..., 3, 3), mm.

        The rotation vector to the frame that is asked for times the lever; of a tangent alone the shortest turn.
        """
        if self.tangent is None:
            return np.zeros((*frames.shape[:-2], 0))
        along = frames[..., 0]
        if self.up is None:
            return LEVER * _shortest(np.broadcast_to(self.tangent, along.shape), along)
        from scipy.spatial.transform import Rotation

        wanted = np.column_stack((self.tangent, np.cross(self.up, self.tangent), self.up))
        off = (frames @ wanted.T).reshape(-1, 3, 3)
        turned = Rotation.from_matrix(off).as_rotvec().reshape(*frames.shape[:-2], 3)
        return LEVER * np.asarray(turned, dtype=float)

    def free(self, design: Design, surrogate: Forward) -> bool:
        """Whether the strip of a design stays out of the boxes, folded and pinched.

        Args:
            design: crease and pinches.
            surrogate: the model.
        """
        if not len(self.keep_out):
            return True
        cell = max(1.0, min(5.0, 0.25 * float(np.ptp(self.keep_out, axis=1).min())))
        swept = Swept(cell=cell)
        for on in (np.zeros(design.n, dtype=bool), design.pinched):
            points, triangles, _ = swept.strip(surrogate, design.k0, design.length, on)
            sampled = np.concatenate((points, points[triangles].mean(axis=1)))[:, None, :]
            inside = (sampled > self.keep_out[:, 0]) & (sampled < self.keep_out[:, 1])
            if inside.all(axis=-1).any():
                return False
        return True


def _vector(value: ArrayLike, name: str) -> Array:
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise DesignError(f"{name} {value!r} is no point; give three coordinates in mm")
    return found


def _stop(part: float, point: ArrayLike, share: float = 1.0) -> Stop:
    if not 0.0 < share <= 1.0:
        raise DesignError(f"a stop at {share:g} of the length of the crease cannot be; give 0 < along <= 1")
    if not 0.0 < part <= 1.0 or part == share == 1.0:
        raise DesignError(f"a pinch that is closed by {part:g} of its way is no stop; give 0 < part < 1")
    return Stop(float(part), _vector(point, "a stop"), float(share))


def _unit(value: Array, name: str) -> Array:
    size = float(np.linalg.norm(value))
    if size < 1e-9:
        raise DesignError(f"{name} has no direction; give three numbers, not all of them zero")
    return value / size


def _shortest(start: Array, end: Array) -> Array:
    """(..., 3) rotation vectors of the shortest turns from unit vectors to others."""
    axis = np.cross(start, end)
    sine, cosine = np.linalg.norm(axis, axis=-1), (start * end).sum(axis=-1)
    angle = np.arctan2(sine, cosine)
    found: Array = axis * (angle / np.where(sine > 1e-12, sine, 1.0))[..., None]
    return found


@dataclass(frozen=True, eq=False)
class ReachAll(ReachPoint):
    """Problem C with more wants than a point.

    Attributes:
        wants: all that is asked for; `target` is its point.
        shift: (k,) added to the residuals: what a simulated strip was off where the chain was right, mm.
    """

    wants: Wants = field(default_factory=lambda: Wants(np.zeros(3)))
    shift: Array = field(default_factory=lambda: np.zeros(1))

    @cached_property
    def _closed(self) -> tuple[Forward, ...]:
        return tuple(self.surrogate.closed_by(stop.part) for stop in self.wants.stops)

    def bare(self, x: Array, on: Bools) -> Array:
        """(N, k) residuals without the shift, mm: of the point, of the direction, of the stops.

        Args:
            x: (N, 2 n) variables.
            on: (N, n) pinches.
        """
        design = self.split(x)
        points, frames = self.surrogate.forward(*design, on, check=False)
        groups = [points[..., -1, :] - self.wants.point, self.wants.turn(frames[..., -1, :, :])]
        for model, stop in zip(self._closed, self.wants.stops, strict=True):
            groups.append(along(model, *design, on, stop.along) - stop.point)
        return np.concatenate(groups, axis=-1)

    def residuals(self, x: Array, on: Bools) -> Array:
        """(N, k) from what is asked for, mm, see `bare`.

        Args:
            x: (N, 2 n) variables.
            on: (N, n) pinches.
        """
        found: Array = self.bare(x, on) + self.shift
        return found

    def steadied(self, x: Array, on: Bools) -> Array:
        """Designs next to others that do the same and whose ends move less with what is not made exactly.

        Movements are brought down beside the residuals, and then these to zero again by the shortest way.

        Args:
            x: (N, 2 n) variables.
            on: (N, n) pinches.

        Returns:
            (N, 2 n) variables.
        """
        return self.polished(descend(_Steady(self), x, on), on)

    def polished(self, x: Array, on: Bools) -> Array:
        """Designs next to candidates that do what is asked for, moved out of the boxes where there are some.

        Args:
            x: (N, 2 n) variables.
            on: (N, n) pinches.

        Returns:
            (N, 2 n) variables.
        """
        x = descend(self, x, on)
        return descend(_Outside(self), x, on) if len(self.wants.keep_out) and len(x) else x

    def off(self, residuals: Array) -> tuple[Array, Array]:
        """(...) largest distance from a point that is asked for, mm, and (...) angle from the direction, rad.

        Args:
            residuals: (..., k) of `bare`.
        """
        turned = 3 if self.wants.directed else 0
        apart = np.concatenate((residuals[..., :3], residuals[..., 3 + turned :]), axis=-1)
        apart = np.linalg.norm(apart.reshape(*apart.shape[:-1], -1, 3), axis=-1).max(axis=-1)
        return apart, np.linalg.norm(residuals[..., 3 : 3 + turned], axis=-1) / LEVER

    def landed(self, design: Design) -> tuple[Landing, Array, float, float]:
        """The whole strip simulated: where it lands, its residuals (k,), and error bars, mm and rad.

        Args:
            design: crease and pinches.

        Raises:
            DesignError: a path ended early.
        """
        landing = self.surrogate.land(*design.lists())
        groups = [landing.end - self.wants.point, self.wants.turn(landing.frame)]
        bar = landing.bar
        landings: dict[float, Landing] = {1.0: landing}
        for model, stop in zip(self._closed, self.wants.stops, strict=True):
            if stop.part not in landings:
                landings[stop.part] = model.land(*design.lists())
            place, doubt = _reached(model, landings[stop.part], design, stop.along)
            groups.append(place - stop.point)
            bar = max(bar, doubt)
        return landing, np.concatenate(groups), bar, landing.turn

    def shifted(self, residuals: Array, x: Array, on: Bools) -> ReachAll:
        """The problem aimed at what a simulated strip missed.

        Args:
            residuals: (k,) of the simulated strip, mm.
            x: (2 n,) its variables.
            on: (n,) its pinches.
        """
        return replace(self, shift=residuals - self.bare(x[None], on[None])[0])


def _reached(model: Forward, landing: Landing, design: Design, share: float) -> tuple[Array, float]:
    """(3,) a point of the crease of a strip that was simulated, and its error bar, mm; see `Converged.land`."""
    if share == 1.0:
        return landing.end, landing.bar
    arrays = design.k0[None], design.length[None], design.pinched[None]
    limit, same = (along(each, *arrays, share)[0] for each in (model, model.same_mesh))
    beside = along_strip(landing.strip, share) - same
    return limit + beside, float(model.bars(*arrays)[0][0] + SHARE * np.linalg.norm(beside))


@dataclass(frozen=True, eq=False)
class _Beside:
    """A problem whose residuals have others beside them; its variables and their ends are the same."""

    problem: ReachAll

    @property
    def lower(self) -> Array:
        return self.problem.lower

    @property
    def upper(self) -> Array:
        return self.problem.upper


class _Steady(_Beside):
    """Residuals of a problem, and beside them a part of the movements of the end by one spread of each thing."""

    def residuals(self, x: Array, on: Bools) -> Array:
        moves = predicted(self.problem.surrogate, *self.problem.split(x), on).moves
        return np.concatenate(
            (self.problem.residuals(x, on), *(STEADY * move for move in moves.values())), axis=-1
        )


class _Outside(_Beside):
    """Residuals of a problem, and beside them how deep the strip is in each box, folded and pinched."""

    def residuals(self, x: Array, on: Bools) -> Array:
        problem = self.problem
        inside = depths(problem.surrogate, problem.wants.keep_out, *problem.split(x), on)
        return np.concatenate((problem.residuals(x, on), inside), axis=-1)
