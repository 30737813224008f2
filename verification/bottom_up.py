"""Case `bottom_up` (source 4.4.2); see `verification.top_down`."""

from verification.top_down import run_bottom_up as run

__all__ = ["run"]
