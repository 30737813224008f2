"""Case `bottom_up` (source 4.4.2); see `verification.studies.ch4.top_down`."""

from verification.studies.ch4.top_down import run_bottom_up as run

__all__ = ["run"]
