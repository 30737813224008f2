"""A mesh of one's own: points, triangles, and which edges are the crease.

What any code writes as arrays is a mesh in one call, and named sets make places of it.
"""

import numpy as np

import bh
import meshes

x, y = np.meshgrid(np.linspace(0, 40, 9), np.linspace(0, 20, 5), indexing="ij")
cell = (5 * np.arange(8)[:, None] + np.arange(4)).ravel()
halves = (cell, cell + 5, cell + 1), (cell + 1, cell + 5, cell + 6)
mesh = meshes.SheetMesh(
    np.column_stack((x.ravel(), y.ravel())),
    np.vstack([np.column_stack(half) for half in halves]),
    edge_sets={"crease:middle": np.column_stack((np.arange(2, 42, 5), np.arange(7, 47, 5)))},
    folds={"middle": "mountain"},
)
path = bh.trace(bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2)).fold("middle", by="90deg")).require()
found = path[-1].energy.total  # a straight crease folds without bending its panels
assert found < 1e-9, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "own_arrays.png")
