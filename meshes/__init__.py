"""Flat geometry: crease patterns, meshes of them, and their file formats."""

from meshes.corrugations import corrugation, corrugation_table, curved_corrugation
from meshes.curves import Arc, ArcChain, Line, Polyline
from meshes.errors import FileFormatError, InputError, MeshError, PatternError
from meshes.library import (
    annulus_sector,
    full_annulus,
    opposite_parabolas,
    parabolic_canopy,
    sine_tessellation,
    strip,
    two_arcs,
)
from meshes.mesh import SheetMesh
from meshes.parallel import parallel_creases
from meshes.pattern import Crease, CreasePattern
from meshes.ruled import ruled
from meshes.structured import structured
from meshes.unstructured import unstructured
from meshes.wide import wide_creases

__all__ = [
    "Arc",
    "ArcChain",
    "Crease",
    "CreasePattern",
    "FileFormatError",
    "InputError",
    "Line",
    "MeshError",
    "PatternError",
    "Polyline",
    "SheetMesh",
    "annulus_sector",
    "corrugation",
    "corrugation_table",
    "curved_corrugation",
    "full_annulus",
    "opposite_parabolas",
    "parabolic_canopy",
    "parallel_creases",
    "ruled",
    "sine_tessellation",
    "strip",
    "structured",
    "two_arcs",
    "unstructured",
    "wide_creases",
]
