"""Every chart in one line: an annulus sector, folded by a spring crease and pushed at its tip."""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=100, width=10, angle=0.785), along=32)
tip = f"node:{mesh.nodes('crease:crease')[-1]}"
model = bh.Model(mesh, bh.Sheet(E=4000, t=0.127)).support("edge:start", "xyz").support("edge:end", "z")
model = model.fold("crease", rest=1.571, Lstar=25.0).displace(tip, "x", by=-6.0)
path = bh.trace(model)

bh.plotting.pattern(model).savefig("one_line_plots_pattern.svg")
bh.plotting.picture(path[-1], "one_line_plots_sheet.png")
bh.plotting.fold_angles(path, "crease").savefig("one_line_plots_fold_angles.svg")
bh.plotting.response(path, tip, "x").savefig("one_line_plots_response.svg")
bh.plotting.curves(path).savefig("one_line_plots_energies.svg")
bh.plotting.animation(path, "one_line_plots.gif", size=(600, 450))
