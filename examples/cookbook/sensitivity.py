"""What matters? Derivatives of the energy by radius, thickness and angle, from one solution.

A crease imposed at an angle: the energy is E t^3 times a function of the shape, so d ln U / d ln t is 3.
"""

import bh
import meshes


def build(p):  # radius and thickness in mm, imposed angle in rad
    mesh = meshes.structured(meshes.annulus_sector(p[0], 8.0, 0.6), along=12, rows=1)
    model = bh.Model(mesh, bh.Sheet(E=4000, t=p[1])).support("corner:inner-start", "xyz")
    model = model.support("corner:outer-start", "yz").support("corner:inner-end", "z")
    return model.fold("crease", to=p[2])


design = [100.0, 0.2, 1.8]
path = bh.trace(build(design), estimate=False).require()
(energy,) = bh.sensitivities.of(path, build, design, [bh.sensitivities.Energy()])
found = float(energy.gradient[1] * 0.2 / energy.value)
assert abs(found - 3.0) < 0.1, found

if __name__ == "__main__":
    bh.plotting.curves(path).savefig("sensitivity.svg")
