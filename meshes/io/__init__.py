"""File formats: FOLD, SVG and DXF in, FOLD, SVG, DXF and triangles (through meshio) out."""

from meshes.io.drawing import read_drawn, read_pattern
from meshes.io.export import write_mesh
from meshes.io.flat_lines import drawn_lines
from meshes.io.fold import read_fold
from meshes.io.fold_writing import FoldedFrame, write_fold
from meshes.io.gltf import write_gltf
from meshes.io.writing import write_pattern

__all__ = [
    "FoldedFrame",
    "drawn_lines",
    "read_drawn",
    "read_fold",
    "read_pattern",
    "write_fold",
    "write_gltf",
    "write_mesh",
    "write_pattern",
]
