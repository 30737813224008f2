"""A crease that yields keeps a part of its fold when it is let go of.

A hinge of stiffness k that yields at M_y and hardens by H keeps (M - M_y) / H.
"""

import bh
import meshes

mesh = meshes.structured(meshes.strip(40, 20, [10]), along=6, rows=1)
law = bh.ElasticPlastic(yield_moment=0.1, hardening=0.03)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.4)).crease("crease", stiffness=0.3, law=law)
path = bh.trace(model.moment("crease", to=0.13).moment("crease", to=0.0), estimate=False).require()
found = float(path[-1].permanent_fold("crease").mean())  # rad
assert abs(found - (0.13 - 0.1) / 0.03) < 1e-6, found

if __name__ == "__main__":
    bh.plotting.picture(path[-1], "kept_fold_of_a_crease.png")
