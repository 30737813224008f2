"""Nested dissection of a graph (George 1973): the order in which a wide sheet is eliminated.

A set of vertices is cut in half along the best of a few lines; the vertices on one side of the cut that touch
the other one are its separator, which is eliminated after both halves. What depends on what is then a binary tree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAF = 12  # vertices that are not cut any further: measured, 8 to 16 differ by less than 5 %
DIRECTIONS = 6  # of cuts


@dataclass(frozen=True)
class Dissection:
    """An elimination order and its tree, children before parents.

    Attributes:
        order: (v,) vertex at every place of the order.
        start: (f + 1,) front k eliminates the places start[k] to start[k + 1].
        parent: (f,) front that needs front k done, -1 for the last.
    """

    order: Ints
    start: Ints
    parent: Ints


def dissect(indptr: Ints, indices: Ints, places: Array | None = None) -> Dissection:
    """Nested dissection of the graph with neighbours indices[indptr[v] : indptr[v + 1]] of vertex v.

    `places` (v, d) are positions in the flat sheet, if there are any. Cuts follow straight lines there, which are
    short, or lines of equal distance in the graph, which follow cells that are slender or lie on a bow.

    Args:
        indptr: (n + 1,) where the neighbours of each vertex begin.
        indices: of the neighbours.
        places: (n, d) positions in the flat sheet; None if there are none.
    """
    keys = _graph_keys(indptr, indices)
    if places is not None and len(places):
        keys = np.column_stack((_lines(places), keys))
    # every set keeps the order of all its vertices along every key, so that nothing is sorted again
    ranks = np.ascontiguousarray(np.argsort(keys, axis=0, kind="stable").T)
    order = np.arange(len(keys))
    side, best = np.full(len(order), -1, dtype=np.int8), np.empty(len(order), dtype=np.int8)
    start, parent = _dissect(order, indptr, indices, np.ascontiguousarray(keys), ranks, LEAF, side, best)
    return Dissection(order, start, parent)


def _lines(places: Array) -> Array:
    """(v, DIRECTIONS) distances from lines in the plane of the two longest axes of all places."""
    centred = places - places.mean(axis=0)
    axes = np.linalg.svd(centred.T @ centred)[0][:, :2]
    angles = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return np.asarray((centred @ axes) @ np.vstack((np.cos(angles), np.sin(angles)))[: axes.shape[1]])


@njit(**KERNEL)
def _dissect(order, indptr, indices, keys, ranks, leaf, side, best):  # type: ignore[no-untyped-def]
    """First place and parent of every front; sorts `order` (v,), overwrites `ranks` (k, v), vertices by every key.

    Compiled code copies no slices, sorts and fills nothing: those would take longer to compile than all the rest.
    `side` (v,) holds -1 (outside the set; 0 and 1 are its halves, 2 the separator), `best` (v,) is room.
    """
    count = len(order)
    most = 2 * count + 2
    stack = np.empty((128, 3), np.int64)
    own_start, own_end, parents = np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most, np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2] = 0, count, -1
    room, ends, at = np.empty(count, np.int64), np.empty(3, np.int64), np.empty(3, np.int64)
    depth, fronts = 1, 0
    while depth > 0:
        depth -= 1
        lo, hi, parent = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        here = fronts
        fronts += 1
        parents[here], own_end[here] = parent, hi
        if hi - lo <= leaf:
            own_start[here] = lo
            continue
        _best_cut(lo, hi, indptr, indices, keys, ranks, side, best)
        ends[0] = ends[1] = ends[2] = 0
        for i in range(lo, hi):
            ends[best[order[i]]] += 1
            side[order[i]] = -1
        own_start[here] = lo + ends[0] + ends[1]
        # the larger half on top: it is done first, and the other's update waits less
        stack[depth, 0], stack[depth, 1], stack[depth, 2] = lo, lo + ends[0], here
        stack[depth + 1, 0], stack[depth + 1, 1], stack[depth + 1, 2] = lo + ends[0], own_start[here], here
        depth += 2
        for row in range(-1, len(ranks)):
            sorted_set = order if row < 0 else ranks[row]
            at[0], at[1], at[2] = lo, lo + ends[0], own_start[here]
            for i in range(lo, hi):
                room[i] = sorted_set[i]
            for i in range(lo, hi):
                half = best[room[i]]
                sorted_set[at[half]] = room[i]
                at[half] += 1
    # parents were numbered before children, right halves before left ones: backwards it is a postorder
    start, parent_of = np.empty(fronts + 1, np.int64), np.empty(fronts, np.int64)
    for k in range(fronts):
        start[k] = own_start[fronts - 1 - k]
        before = parents[fronts - 1 - k]
        parent_of[k] = fronts - 1 - before if before >= 0 else -1
    start[fronts] = count
    return start, parent_of


@njit(**INNER)
def _gap(keys, ranks, direction, lo, hi):  # type: ignore[no-untyped-def]
    """Where to cut so that the halves are most alike but rows of equal keys are not torn, if that can be."""
    count = hi - lo
    middle = lo + count // 2
    tie = 1e-6 * (keys[ranks[direction, hi - 1], direction] - keys[ranks[direction, lo], direction])
    for away in range(count // 6 + 1):
        for after in range(2):
            half = middle + away if after else middle - away
            step = keys[ranks[direction, half], direction] - keys[ranks[direction, half - 1], direction]
            if step > tie:
                return half
    return middle


@njit(**INNER)
def _best_cut(lo, hi, indptr, indices, keys, ranks, side, best):  # type: ignore[no-untyped-def]
    """Writes 0, 1 (halves) or 2 (separator) into `best` for the set at lo:hi, by the cut of fewest separators."""
    fewest = hi - lo + 1
    touching = np.empty(2, np.int64)
    for direction in range(keys.shape[1]):
        half = _gap(keys, ranks, direction, lo, hi)
        for i in range(lo, hi):
            side[ranks[direction, i]] = 0 if i < half else 1
        touching[0] = touching[1] = 0
        for i in range(lo, hi):
            v = ranks[0, i]
            for e in range(indptr[v], indptr[v + 1]):
                if side[indices[e]] == 1 - side[v]:
                    touching[side[v]] += 1
                    break
        lesser = 0 if touching[0] <= touching[1] else 1
        if touching[lesser] >= fewest:
            continue
        fewest = touching[lesser]
        for i in range(lo, hi):
            v = ranks[0, i]
            best[v] = side[v]
            if side[v] == lesser:
                for e in range(indptr[v], indptr[v + 1]):
                    if side[indices[e]] == 1 - lesser:
                        best[v] = 2
                        break


@njit(**KERNEL)
def _spread(indptr, indices, source, distance, queue):  # type: ignore[no-untyped-def]
    """Write the edges from `source` to every vertex into `distance` (v,), which holds -1; `queue` (v,) is room."""
    distance[source] = 0
    queue[0] = source
    done, found = 0, 1
    while done < found:
        v = queue[done]
        done += 1
        for e in range(indptr[v], indptr[v + 1]):
            w = indices[e]
            if distance[w] < 0:
                distance[w] = distance[v] + 1
                queue[found] = w
                found += 1


def _distances(indptr: Ints, indices: Ints, source: int) -> Ints:
    """(v,) edges from `source` to every vertex; -1 where there is no way."""
    distance = np.full(len(indptr) - 1, -1, dtype=np.int64)
    _spread(indptr, indices, source, distance, np.empty_like(distance))
    return distance


def _graph_keys(indptr: Ints, indices: Ints) -> Array:
    """(v, 5) distances in the graph from three vertices far apart, and two of their differences."""
    count = len(indptr) - 1
    if count == 0:
        return np.zeros((0, 5))
    far: list[Ints] = []
    nearest = _distances(indptr, indices, 0)
    for _ in range(3):
        far.append(_distances(indptr, indices, int(np.argmax(nearest))))
        nearest = np.minimum(nearest, far[-1]) if len(far) > 1 else far[-1]
    return np.column_stack((*far, far[0] - far[1], far[1] - far[2])).astype(float)
