"""File formats: FOLD in and out, triangles out through meshio."""

from meshes.io.export import write_mesh
from meshes.io.fold import read_fold, write_fold

__all__ = ["read_fold", "write_fold", "write_mesh"]
