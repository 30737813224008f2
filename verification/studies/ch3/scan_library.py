"""What can be known of the motion of a scan, and what a library's registration finds of it (case `scan`)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import bh
from bh.applications import scan
from verification.framework.checks import CaseResult

Array = NDArray[np.float64]
ITERATIONS, POINTS = 50, 3000  # of the registration of the library
FEWER = 10  # every tenth point of a scan


def beside(
    result: CaseResult,
    cloud: Array,
    state: bh.State,
    start: scan.Motion,
    found: scan.Registration,
    motion: scan.Motion,
    params: dict[str, Any],
) -> None:
    """What can be known of a motion, and what a library's registration finds from the same guess, strays left out."""
    few = scan.register(cloud[::FEWER], state, start)
    for share, each in ((1, found), (FEWER, few)):
        along = float(each.standard_error[:3].max())
        says = "standard error of the motion, along the sheet"
        result.check(says, along, unit="mm", params={**params, "every": share})
    theirs = by_points(cloud[found.kept], state, start, ITERATIONS, POINTS)
    for by, moved in (("bh.scan", found.motion), ("vtk", theirs)):
        left = moved.after(motion)
        off = np.linalg.norm(left.apply(found.centre) - found.centre)
        result.check("motion left, centre of the sheet", off, unit="mm", params={**params, "by": by})


def by_points(cloud: Array, state: bh.State, start: scan.Motion, iterations: int, points: int) -> scan.Motion:
    """The motion by `vtkIterativeClosestPointTransform`, which draws points to points, each to its nearest place.

    Args:
        cloud: (k, 3) scan points without strays, which it does not leave out, mm.
        state: the sheet.
        start: initial guess.
        iterations: at most.
        points: of the cloud that it looks at.
    """
    import pyvista as pv
    from vtkmodules.vtkCommonDataModel import vtkIterativeClosestPointTransform

    sheet = pv.PolyData.from_regular_faces(state.points, state.mesh.triangles)
    found = vtkIterativeClosestPointTransform()
    found.SetSource(pv.PolyData(start.apply(cloud)))
    found.SetTarget(sheet)
    found.GetLandmarkTransform().SetModeToRigidBody()
    found.SetMaximumNumberOfIterations(iterations)
    found.SetMaximumNumberOfLandmarks(points)
    found.Update()
    matrix = np.array([[found.GetMatrix().GetElement(i, j) for j in range(4)] for i in range(3)])
    return scan.Motion(matrix[:, :3], matrix[:, 3]).after(start)
