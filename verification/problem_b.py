"""Case `problem_b`; see `verification.problem_a`."""

from verification.problem_a import run_b as run

__all__ = ["run"]
