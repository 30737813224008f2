"""Pictures of what a case is set up with: the flat pattern with its creases and supports."""

from __future__ import annotations

from bh import Model
from bh.plotting import pattern
from verification.framework.checks import CaseResult, Context


def draw(result: CaseResult, context: Context, model: Model, caption: str) -> None:
    """Write the flat pattern of a model beside the results and show it before the other pictures of the case."""
    drawn = sum(picture["file"].startswith(f"{result.name}_setup") for picture in result.pictures)
    file = f"{result.name}_setup{drawn or ''}.png"
    pattern(model).savefig(context.folder / file, dpi=140, bbox_inches="tight", metadata={"Software": None})
    alt = f"Flat pattern with creases and supports: {caption}"
    result.pictures.insert(drawn, {"file": file, "alt": alt, "caption": f"Set-up: {caption}"})
