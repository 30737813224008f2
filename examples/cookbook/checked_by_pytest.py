"""A test of one's own: the energy converges, and at which rate.

The same call in a test function of pytest keeps solved levels, and fails with a table.
"""

import bh
import meshes
from bh.testing import assert_energy_converges


def bracket(rows: int) -> bh.Model:
    mesh = meshes.structured(meshes.annulus_sector(80, 12, 0.6), along=4 * rows, rows=rows)
    return bh.Model(mesh, bh.Sheet(E=3000, nu=0.3, t=0.25)).fold("crease", by=1.2217)


converged = assert_energy_converges(bracket, (1, 2, 4), within=0.2)
found = converged.limit.value
assert abs(found / 0.1378 - 1) < 0.05, found

if __name__ == "__main__":
    bh.plotting.picture(bh.trace(bracket(4))[-1], "checked_by_pytest.png")
