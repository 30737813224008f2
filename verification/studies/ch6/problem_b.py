"""Case `problem_b`; see `verification.studies.ch6.problem_a`."""

from verification.studies.ch6.problem_a import run_b as run

__all__ = ["run"]
