"""Force against displacement: press a buckled strip back, and find the peak.

`bh response scene.toml --at near:30,5 --axis z --to -4mm` does the same for a scene.
"""

import bh
import meshes
from bh.applications.response import picture, response

mesh = meshes.structured(meshes.strip(60, 10, [5], "flat"), along=24, rows=2)
model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.0, t=0.3), formulation="consistent")
model = model.support("edge:start", "xyz", clamp=True).support("edge:end", "yz", clamp=True)
model = model.step(bh.Displace("edge:end", "x", by=-0.3), bh.Force("near:30,5", each=(0, 0, 0.3)))
model = model.step(bh.Force("near:30,5", each=(0, 0, 0.0)), bh.Displace("edge:end", "x", by=-1.0))
curve = response(model, "near:30,5", (0, 0, -1), 4.0, points=8)
found = curve.peaks[0].force  # N, the largest
assert abs(found - 0.402) < 0.01, found

if __name__ == "__main__":
    picture(curve).savefig("force_against_displacement.svg")
