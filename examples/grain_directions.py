"""One card, folded along one curved crease, with its grain along, across and at 45 degrees to the crease's middle.

Nothing holds the card, so that the grain alone decides how far its ends come together; at 45 degrees it winds up, one
end against the other. Pictures are coloured by the stress over the strength of the card.
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
    path = bh.trace(bh.Model(mesh, card).fold("crease", by="60deg")).require()
    last = path[-1]
    ends = [last.points[mesh.nodes(f"edge:{side}")].mean(axis=0) for side in ("start", "end")]
    apart = np.linalg.norm(ends[1] - ends[0])
    print(
        f"grain at {np.degrees(off):.0f} degrees: energy {last.energy.total:.3f} N mm, ends {apart:.2f} mm apart, "
        f"wound by {wound(last):.2f} degrees, stress up to {last.stress().worst().utilisation:.2f} of the strength"
    )
    bh.plotting.picture(last, picture, "utilisation", (900, 560))
