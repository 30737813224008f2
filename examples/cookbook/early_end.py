"""A step that cannot be: the path says that it ended early, and `require` raises with the reason.

Here the sheet is asked to store more energy than a fold to 60 degrees brings. `trace` warns unless it is told not to.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=80, width=10, angle=0.6), along=12, rows=2)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2))
model = model.fold("crease", by="60deg", until=bh.Until("energy", 5.0))
path = bh.trace(model, estimate=False, warn=False)
found = path[-1].energy.total  # N mm, of 5
assert path.outcome == "target-missed"
assert found < 0.1, found
try:
    path.require()
except bh.NotReachedError as error:
    print(error)

if __name__ == "__main__":
    bh.plotting.curves(path).savefig("early_end.svg")
