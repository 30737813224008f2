"""Card has a grain: along the crease it is another sheet than across it.

Materials by name bring both moduli; the grain is an angle in the drawing.
"""

import bh
import meshes

mesh = meshes.structured(meshes.annulus_sector(radius=100, width=12, angle=0.8), along=16, rows=4)


def energy(grain: str) -> float:
    card = bh.materials.sheet("card-300", grain=grain)
    model = bh.Model(mesh, card, formulation="consistent").fold("crease", by="60deg")
    return bh.trace(model, estimate=False).require()[-1].energy.total


found = energy("23deg") / energy("113deg")  # across the middle of the crease over along it
assert abs(found - 0.546) < 0.005, found

if __name__ == "__main__":
    bh.plotting.pattern(bh.Model(mesh, bh.materials.sheet("card-300", grain="23deg"))).savefig("grain.svg")
