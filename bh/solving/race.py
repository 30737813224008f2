"""Which formulation at which level comes next in a run to an accuracy, and when it is given up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from bh.model.refinement import Goal, Refinement
from bh.paths.estimate import Trial
from bh.solvers.outcome import Outcome

FALLING = 0.9  # an estimate that does not fall by this factor from one mesh to the next falls no more
# s that an iteration takes for each unknown of a mesh on one core: the median of the stored records of 231 runs of the
# consistent formulation is 5.7e-6, of 25 of the shell 5.2e-6
ITERATION = 5.5e-6
LOST = 3  # meshes in a row whose path ends early


@dataclass
class Race:
    """The formulation that is likely to be the cheapest begins, with three levels.

    Where its estimate does not hold it is refined further, unless another one is likely to do the whole in less time
    than that level takes.

    Attributes:
        goal: what is asked for.
        options: the formulations and what is known of them.
        tried: of each formulation that was begun its levels, in order.
        out: why a formulation is refined no more, one line.
    """

    goal: Goal
    options: Mapping[str, Refinement]
    tried: dict[str, list[float]] = field(default_factory=dict)
    out: dict[str, str] = field(default_factory=dict)

    def next(self) -> tuple[str, int] | None:
        """(formulation, number of its level from 0), or None where all are given up."""
        within = self.goal.within
        now = next(reversed(self.tried), "")
        fresh = [name for name in self.options if name not in self.tried and name not in self.out]
        best = min(fresh, key=lambda name: self.options[name].time(within), default="")
        if now in self.out:
            now = ""
        if now and best and len(self.tried[now]) >= 3 and self.options[best].time(within) < self._cost(now):
            now = ""
        now = now or best
        if not now:
            return None
        levels = self.tried.setdefault(now, [])
        levels.append(2.0 * levels[-1] if levels else self.first(now))
        return now, len(levels) - 1

    def first(self, name: str) -> float:
        """The level that a formulation begins with: a quarter of the one that is likely to do."""
        return self.options[name].level(self.goal.within) / 4.0

    def judge(self, name: str, trials: Sequence[Trial], errors: Sequence[float]) -> None:
        """Give a formulation up that is of no use after its last trial; `errors` are its estimates so far.

        Args:
            name: of the formulation.
            trials: its own, coarse to fine.
            errors: estimates of its error, relative.
        """
        own = [trial for trial in trials if trial.formulation == name]
        finer = 4 * own[-1].triangles
        if all(trial.outcome is not Outcome.REACHED for trial in own[-LOST:]) and len(own) >= LOST:
            self.out |= dict.fromkeys(self.options, f"the paths of {LOST} meshes in a row end early")
        elif len(errors) > 3 and errors[-1] > FALLING * errors[-2]:
            self.out[name] = f"the estimate of {name} falls no more"
        elif finer > self.goal.most_triangles:
            most = self.goal.most_triangles
            self.out[name] = f"the next mesh of {name} has some {finer:,} triangles, more than {most:,}"

    def too_long(self, trials: Sequence[Trial]) -> str:
        """Why the level that `next` has just named is not begun, empty where there is the time for it.

        Seconds are counted by work, so that the same mesh is chosen on every machine, whatever else runs on it.

        Args:
            trials: all so far.
        """
        if self.goal.seconds is None or not trials:
            return ""
        name = next(reversed(self.tried))
        costs = [
            self.options[t.formulation].cost * t.level ** self.options[t.formulation].power for t in trials
        ]
        spent = ITERATION * sum(t.unknowns * t.iterations for t in trials)
        unit = spent / sum(costs)
        option = self.options[name]
        ahead = unit * option.cost * self.tried[name][-1] ** option.power
        if spent + ahead <= self.goal.seconds:
            return ""
        return f"the next mesh takes some {ahead:.2g} s, more than is left of {self.goal.seconds:g} s"

    def _cost(self, name: str) -> float:
        option = self.options[name]
        return float(option.cost * (2.0 * self.tried[name][-1]) ** option.power)
