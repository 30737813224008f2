"""Where a curve is cut into pieces: at its ends, at its corners, and where the ends of other curves lie on it."""

from __future__ import annotations

import numpy as np

from meshes.curves import Array, Curve, Line, Polyline, arc_lengths
from meshes.planar import corners

SAMPLES = 2048  # pieces of a curve that is not straight, among which the nearest one is sought


def breaks(curve: Curve, ends: Array, near: float) -> list[float]:
    """Parameters where the curve begins, ends, has a corner, or another curve ends on it.

    Args:
        curve: to be cut.
        ends: (n, 2) ends of all curves, mm.
        near: distance in which an end lies on the curve, mm.

    Returns:
        the parameters, rising from 0 to 1.
    """
    own = curve.point(np.array([0.0, 1.0]))
    ends = ends[(np.abs(ends[:, None] - own).max(axis=2) > near).all(axis=1)]
    found = [0.0, 1.0]
    if isinstance(curve, Line | Polyline):
        vertices = own if isinstance(curve, Line) else curve.vertices
        found += _on_segments(vertices, ends, near)
        lengths = arc_lengths(vertices)
        found += (lengths[1:-1][corners(vertices)[1:-1]] / lengths[-1]).tolist()
    else:
        found += _on_curve(curve, ends, near)
    found.sort()
    apart = 2.0 * near / curve.length
    kept = [value for i, value in enumerate(found) if i == 0 or value - found[i - 1] > apart]
    kept[-1] = 1.0  # itself, not a break found next to it
    return kept


def _within(ends: Array, points: Array, reach: float) -> Array:
    """The (k, 2) ends in the box of the points, `reach` wider on all sides, each once."""
    low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
    return np.unique(ends[(ends > low).all(axis=1) & (ends < high).all(axis=1)], axis=0)


def _on_segments(vertices: Array, ends: Array, near: float) -> list[float]:
    """Parameters, in parts of the length, where ends lie on the segments through (k, 2) vertices."""
    ends = _within(ends, vertices, near)
    start, along = vertices[:-1], np.diff(vertices, axis=0)
    lengths = arc_lengths(vertices)
    size = np.maximum((along**2).sum(axis=1), 1e-300)
    found = []
    for end in ends:
        part = np.clip(((end - start) * along).sum(axis=1) / size, 0.0, 1.0)
        distance = np.linalg.norm(start + part[:, None] * along - end, axis=1)
        k = int(distance.argmin())
        if distance[k] < near:
            found.append(float((lengths[k] + part[k] * (lengths[k + 1] - lengths[k])) / lengths[-1]))
    return found


def _on_curve(curve: Curve, ends: Array, near: float) -> list[float]:
    """Parameters where ends lie on a curve of which only points are known."""
    u = np.linspace(0.0, 1.0, SAMPLES + 1)
    samples = curve.point(u)
    reach = 2.0 * curve.length / SAMPLES
    found = []
    for end in _within(ends, samples, reach):
        distance = np.linalg.norm(samples - end, axis=1)
        k = int(distance.argmin())
        if distance[k] > reach:
            continue
        low, high = u[max(k - 1, 0)], u[min(k + 1, SAMPLES)]
        for _ in range(60):  # the distance has one minimum between neighbouring samples
            third = (high - low) / 3.0
            one, two = np.linalg.norm(curve.point(np.array([low + third, high - third])) - end, axis=1)
            low, high = (low, high - third) if one < two else (low + third, high)
        middle = 0.5 * (low + high)
        if np.linalg.norm(curve.point(np.array([middle]))[0] - end) < near:
            found.append(float(middle))
    return found
