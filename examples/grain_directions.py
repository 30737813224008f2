"""One card, folded along one curved crease, with its grain along, across and at 45 degrees to the crease's middle.

Nothing holds the card and the same couple folds it, so that the grain alone decides how far: by 49, 57 and 66 degrees,
and at 45 degrees the card winds up, one end against the other. Pictures are coloured by the stress
over the strength of the card.
"""

import numpy as np

import bh
import meshes

TURN = np.radians(90.0)  # that the crease goes round
ALONG = 0.5 * TURN + 0.5 * np.pi  # its direction in the middle
mesh = meshes.structured(meshes.annulus_sector(radius=100.0, width=25.0, angle=TURN), along=32, rows=4)


def wound(state: bh.State) -> float:
    """Angle between the chords of the two ends seen along the line from one to the other, degrees."""
    ends = [state.points[mesh.nodes(f"edge:{side}")] for side in ("start", "end")]
    axis = ends[1].mean(axis=0) - ends[0].mean(axis=0)
    axis /= np.linalg.norm(axis)
    chords = [
        state.points[mesh.nodes(f"corner:outer-{side}")[0]]
        - state.points[mesh.nodes(f"corner:inner-{side}")[0]]
        for side in ("start", "end")
    ]
    across = [chord - axis * (chord @ axis) for chord in chords]
    return float(np.degrees(np.arctan2(axis @ np.cross(*across), across[0] @ across[1])))


GRAINS = {
    "grain_directions_along.png": 0.0,
    "grain_directions_diagonal.png": 0.25 * np.pi,
    "grain_directions_across.png": 0.5 * np.pi,
}
for picture, off in GRAINS.items():
    card = bh.materials.sheet("card-300", grain=ALONG + off)
    model = bh.Model(mesh, card).crease("crease", stiffness=0.001).moment("crease", to=0.03)
    path = bh.trace(model).require()
    last = path[-1]
    ends = [last.points[mesh.nodes(f"edge:{side}")].mean(axis=0) for side in ("start", "end")]
    apart = np.linalg.norm(ends[1] - ends[0])
    folded = np.degrees(last.fold_angle("crease").mean())
    print(
        f"grain at {np.degrees(off):.0f} degrees: folded by {folded:.1f} degrees, "
        f"energy {last.energy.total:.3f} N mm, ends {apart:.2f} mm apart, "
        f"wound by {wound(last):.2f} degrees, stress up to {last.stress().worst().utilisation:.2f} of the strength"
    )
    bh.plotting.picture(last, picture, "utilisation", (900, 560))
