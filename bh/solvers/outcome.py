"""How a step of a path can end, and what it can pass. The values are what result files, path files and tables hold."""

from __future__ import annotations

from enum import StrEnum


class Outcome(StrEnum):
    """The end of a step, of a path, or of a point of a sweep; only `REACHED` is a success."""

    REACHED = "reached"
    LIMIT_POINT = "limit-point"
    BIFURCATION = "bifurcation"
    MECHANISM = "mechanism"
    CONTACT = "contact"
    UNSTABLE = "unstable"  # in equilibrium, but on a branch that the sheet would leave
    STALLED = "stalled"
    TARGET_MISSED = "target-missed"  # what an `Until` wants does not come about
    UNFINISHED = "unfinished"  # a path whose run was stopped
    REFUSED = "refused"  # a point of a sweep that cannot be solved as described
    FAILED = "failed"  # a point of a sweep whose task has raised


class Critical(StrEnum):
    """What an eigenvalue that goes through zero means: the load turns back, or the path branches."""

    LIMIT = "limit"
    BIFURCATION = "bifurcation"
