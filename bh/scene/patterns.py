"""Tables `[pattern]` of a scene: the patterns of the library, and files that hold one."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

import meshes
from bh.scene.reading import (
    ACROSS,
    ALONG,
    ALTERNATING,
    FOLDS,
    RADII,
    Curvature,
    Distance,
    Few,
    Folds,
    Length,
    Panels,
    Positive,
    Power,
    Scale,
    SectorAngle,
    Table,
)
from meshes import CreasePattern
from meshes.corrugations import KINDS as CORRUGATIONS


class PatternTable(Table):
    """A pattern of the library, drawn by the function of `meshes` that has the name of its kind."""

    def draw(self) -> CreasePattern:
        """Draw the pattern, mm.

        Raises:
            PatternError: values that do not go together.
        """
        given = dict(self)
        kind, folds = given.pop("kind"), given.pop("fold")
        drawn: CreasePattern = getattr(meshes, kind.replace("-", "_"))(folds=folds, **given)
        return drawn


class StripPattern(PatternTable):
    """A strip with straight creases."""

    kind: Literal["strip"]
    length: Length = Field(description="a positive length along x in mm")
    width: Length = Field(description="a positive width along y in mm")
    creases: list[Distance] = Field(
        [], description="a list of rising heights y in mm between 0 and the width"
    )
    fold: Folds = Field("mountain", description=FOLDS)


class AnnulusSectorPattern(PatternTable):
    """A sector of an annulus with concentric creases."""

    kind: Literal["annulus_sector"]
    radius: Length | list[Length] = Field(description=RADII)
    width: Length = Field(description="a positive width each side of the creases in mm")
    angle: SectorAngle = Field(
        description='a sector angle in rad inside (0, 2 pi); kind = "full_annulus" is the whole turn'
    )
    fold: Folds = Field("mountain", description=FOLDS)


class FullAnnulusPattern(PatternTable):
    """A whole annulus with concentric creases."""

    kind: Literal["full_annulus"]
    radius: Length | list[Length] = Field(description=RADII)
    width: Length = Field(description="a positive width each side of the creases in mm")
    fold: Folds = Field("mountain", description=FOLDS)


class ParallelPattern(PatternTable):
    """Parallel creases described by the first of them."""

    kind: Literal["parallel_creases"]
    curvature: Curvature | Annotated[list[Curvature], Field(min_length=1)] = Field(
        description="the curvature of the first crease in 1/mm, of any sign, or a list with one of them a piece"
    )
    length: Length | Annotated[list[Length], Field(min_length=1)] = Field(
        description="the length of the first crease in mm, or a list with one of them a piece"
    )
    spacing: Length = Field(5.0, description="a positive distance between creases and to the edges in mm")
    creases: Annotated[int, Field(ge=1, le=1000)] = Field(1, description="a whole number of creases, from 1")
    fold: Folds | None = Field(None, description=FOLDS + "; alternating from mountain unless given")


class CorrugationPattern(PatternTable):
    """One of the five corrugations of the source (4.3)."""

    kind: Literal["straight", "parabolic-point", "parabolic-edge", "elliptical-point", "elliptical-edge"] = (
        Field(
            description='"straight", "parabolic-point", "parabolic-edge", "elliptical-point" or "elliptical-edge"'
        )
    )
    width: Length = Field(100.0, description="a positive length W along x in mm")
    height: Length = Field(100.0, description="a positive length H along y in mm")
    panels: Panels = Field(5, description="a whole number of sheets between creases, from 2 to 100")
    fold: Folds | None = Field(None, description=FOLDS)

    def draw(self) -> CreasePattern:
        """Draw the pattern, mm."""
        return meshes.corrugation(self.kind, self.width, self.height, self.panels, self.fold)


class CurvedCorrugationPattern(PatternTable):
    """A corrugation of the family of `meshes.curved_corrugation`."""

    kind: Literal["curved-corrugation"]
    exponent: Power = Field(2.0, description="a number p from 1 to 100 (2 for parabolas and ellipses)")
    root: Power = Field(1.0, description="a number q from 1 to 100 (1 for parabolas, 2 for ellipses)")
    spread: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        0.0, description="a number from 0 (creases end at the straight edge) to 1 (in the corners)"
    )
    width: Length = Field(100.0, description="a positive length W along x in mm")
    height: Length = Field(100.0, description="a positive length H along y in mm")
    panels: Panels = Field(5, description="a whole number of sheets between creases, from 2 to 100")
    fold: Folds | None = Field(None, description=FOLDS)


class TwoArcsPattern(PatternTable):
    """Two circular creases across a rectangle."""

    kind: Literal["two_arcs"]
    width: Length = Field(100.0, description=ALONG)
    height: Length = Field(100.0, description=ACROSS)
    radii: list[Length] = Field(
        [80.0, 250.0], description="radii in mm, each at least half the width, from below"
    )
    at: list[Distance] = Field([35.0, 70.0], description="heights in mm of the tops of the arcs, rising")
    fold: Folds = Field(["mountain", "valley"], description=FOLDS)


class SineTessellationPattern(PatternTable):
    """Sine creases across a rectangle."""

    kind: Literal["sine_tessellation"]
    width: Length = Field(100.0, description=ALONG)
    height: Length = Field(100.0, description=ACROSS)
    creases: Few = Field(5, description="a whole number of creases, from 1")
    amplitude: Length = Field(4.0, description="the amplitude of the sines in mm")
    waves: Positive = Field(2.0, description="how many waves fit into the width, a positive number")
    fold: Folds | None = Field(None, description=ALTERNATING)


class ParabolicCanopyPattern(PatternTable):
    """Equal parabolas across a rectangle."""

    kind: Literal["parabolic_canopy"]
    width: Length = Field(100.0, description=ALONG)
    height: Length = Field(100.0, description=ACROSS)
    creases: Few = Field(3, description="a whole number of creases, from 1")
    sag: Distance = Field(15.0, description="how much lower the ends of a parabola are than its top, mm")
    fold: Folds | None = Field(None, description=ALTERNATING)


class OppositeParabolasPattern(PatternTable):
    """Two parabolas that face each other across a square."""

    kind: Literal["opposite_parabolas"]
    side: Length = Field(100.0, description="the side of the square in mm")
    gap: Length = Field(30.0, description="the distance between the tops in mm")
    sag: Length = Field(20.0, description="from a top to the ends of its parabola in mm")
    fold: Folds = Field("mountain", description=FOLDS)


class DrawingPattern(Table):
    """A drawing, or a FOLD file."""

    file: Annotated[str, Field(min_length=1)] = Field(
        description="the name of an .svg, .dxf, .fold, .cp or .opx file, from the folder of the scene"
    )
    scale: Scale | None = Field(None, description="how many mm a unit of the drawing is, a positive number")
    fit: Length | None = Field(None, description="the longer side of the sheet in mm, in place of scale")
    tolerance: Length | None = Field(None, description="how far chords may stay off curves, in mm")
    gap: Length | None = Field(
        None, description="up to which distance lines that miss each other are joined, in mm"
    )
    outline: Literal["drawn", "hull"] = Field(
        "drawn", description='"drawn", or "hull" for the convex hull of what is drawn'
    )
    lines: dict[str, str] = Field(
        {}, description='what lines stand for, such as { "#00aa00" = "valley", "layer:score" = "mountain" }'
    )
    frame: Annotated[int, Field(ge=0, le=1_000_000)] | Annotated[str, Field(min_length=1)] | None = Field(
        None, description="of a FOLD file: a frame number from 0 (the key frame), or the title of a frame"
    )
    untangle: bool | Length = Field(
        False,
        description="of a FOLD file: true, or a distance in mm: layers of a folded form are moved apart by faceOrders",
    )
    sheet: Annotated[int, Field(ge=1, le=1_000)] | None = Field(
        None, description="which of several sheets that are drawn, from 1, in rows from the top left"
    )


LIBRARY: dict[str, type[PatternTable]] = {
    "strip": StripPattern,
    "parallel_creases": ParallelPattern,
    "annulus_sector": AnnulusSectorPattern,
    "full_annulus": FullAnnulusPattern,
    **dict.fromkeys(CORRUGATIONS, CorrugationPattern),
    "curved-corrugation": CurvedCorrugationPattern,
    "two_arcs": TwoArcsPattern,
    "sine_tessellation": SineTessellationPattern,
    "parabolic_canopy": ParabolicCanopyPattern,
    "opposite_parabolas": OppositeParabolasPattern,
}
