"""One sheet by three formulations, side by side, to turn in a browser; their energies agree to a few percent."""

import bh
import meshes

pattern = meshes.annulus_sector(radius=100, width=10, angle=0.785)
sheet = bh.Sheet(E=4000, nu=0.38, t=0.127)
sheets = {
    "bars-and-hinges": meshes.structured(pattern, along=32, rows=1, kind="staggered"),
    "consistent": meshes.structured(pattern, along=32, rows=4, kind="mirrored"),
    "shell": meshes.structured(pattern, along=32, rows=2, kind="mirrored"),
}
paths = {}
for formulation, mesh in sheets.items():
    model = bh.Model(mesh, sheet, formulation=formulation)
    for fraction in (0.25, 0.5, 0.75, 1.0):
        model = model.fold("crease", by=1.571 * fraction)
    paths[formulation] = bh.trace(model)
    print(f"{formulation:16} {paths[formulation][-1].energy.total:.4f} N mm")

bh.interactive.view(paths, "One sheet by three formulations").save("three_models.html")
bh.plotting.picture(paths["shell"][-1], "three_models_shell.png")
