"""Bar-and-hinge simulation of sheets folded along curved creases.

Everything below is loaded when it is first used, so that `import bh` is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bh.runtime import viewer as _viewer
from bh.runtime.kernel_cache import ensure as _ensure_kernel_cache

if TYPE_CHECKING:
    from bh.applications.calibrated import Calibration
    from bh.applications.calibration import calibrate
    from bh.applications.readings import Measured, Scanned
    from bh.commands.read import Run, read
    from bh.errors import (
        InputError,
        ModelError,
        NotReachedError,
        NotReachedWarning,
        PathFileError,
        SceneError,
    )
    from bh.formulations.protocols import Formulation, SheetSystem
    from bh.formulations.registry import remarks
    from bh.formulations.remarks import Remark
    from bh.formulations.state import Energy, State
    from bh.model.actuations import Displace, Fold, Force, Indenter, Moment, Pull, Tether
    from bh.model.crease_law import CreaseLaw
    from bh.model.growth import Expand
    from bh.model.hinge_laws import Bilinear, ElasticPlastic, HingeLaw, MomentTable, Softening
    from bh.model.imperfection import RandomField, imperfect
    from bh.model.laminate import laminate
    from bh.model.loads import AreaForce, Couple, EdgeMoment, LineForce, Pressure
    from bh.model.model import Model
    from bh.model.mould import Mould
    from bh.model.pinch import Pinch
    from bh.model.refinement import Goal, Refinement
    from bh.model.sheet import ElementStiffness, Sheet
    from bh.model.springs import GroundSpring
    from bh.model.step import Actuation, Body, Step, StepBuilder, Zone
    from bh.model.supports import Constraint, Hold, RigidBody, Support
    from bh.model.until import Until, depth
    from bh.model.weight import Weight
    from bh.model.zones import SheetZone
    from bh.paths.estimate import Accuracy
    from bh.paths.path import Path
    from bh.runtime.consent import allow_outside, allow_plugins
    from bh.scene.load import load_scene
    from bh.solvers.arc_length import ArcLength, DisplacementControl
    from bh.solvers.automatic import Automatic
    from bh.solvers.load_control import LoadControl
    from bh.solvers.newton import Newton
    from bh.solvers.outcome import Outcome
    from bh.solvers.settling import Settling
    from bh.solving.trace import trace

# where a name is; `tests/test_architecture.py` holds it against the imports above
_NAMES = {
    "bh.applications.calibrated": "Calibration",
    "bh.applications.calibration": "calibrate",
    "bh.applications.readings": "Measured Scanned",
    "bh.commands.read": "Run read",
    "bh.errors": "InputError ModelError NotReachedError NotReachedWarning PathFileError SceneError",
    "bh.formulations.protocols": "Formulation SheetSystem",
    "bh.formulations.registry": "remarks",
    "bh.formulations.remarks": "Remark",
    "bh.formulations.state": "Energy State",
    "bh.model.actuations": "Displace Fold Force Indenter Moment Pull Tether",
    "bh.model.crease_law": "CreaseLaw",
    "bh.model.growth": "Expand",
    "bh.model.hinge_laws": "Bilinear ElasticPlastic HingeLaw MomentTable Softening",
    "bh.model.imperfection": "RandomField imperfect",
    "bh.model.loads": "AreaForce Couple EdgeMoment LineForce Pressure",
    "bh.model.laminate": "laminate",
    "bh.model.model": "Model",
    "bh.model.pinch": "Pinch",
    "bh.model.refinement": "Goal Refinement",
    "bh.model.sheet": "ElementStiffness Sheet",
    "bh.model.springs": "GroundSpring",
    "bh.model.mould": "Mould",
    "bh.model.step": "Actuation Body Step StepBuilder Zone",
    "bh.model.supports": "Constraint Hold RigidBody Support",
    "bh.model.until": "Until depth",
    "bh.model.weight": "Weight",
    "bh.model.zones": "SheetZone",
    "bh.paths.estimate": "Accuracy",
    "bh.paths.path": "Path",
    "bh.runtime.consent": "allow_outside allow_plugins",
    "bh.scene.load": "load_scene",
    "bh.solvers.arc_length": "ArcLength DisplacementControl",
    "bh.solvers.automatic": "Automatic",
    "bh.solvers.load_control": "LoadControl",
    "bh.solvers.newton": "Newton",
    "bh.solvers.outcome": "Outcome",
    "bh.solvers.settling": "Settling",
    "bh.solving.trace": "trace",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}
_SUBMODULES = {
    "buckling": "bh.analysis.buckling",
    "contact": "bh.analysis.contact",
    "corrugation": "bh.applications.corrugation",
    "creases": "bh.analysis.creases",
    "interactive": "bh.plotting.interactive",
    "isometric": "bh.analysis.isometric",
    "live": "bh.live",
    "materials": "bh.materials",
    "node_sensitivities": "bh.analysis.node_sensitivities",
    "pinching": "bh.applications.pinching",
    "plotting": "bh.plotting",
    "polish": "bh.applications.polish",
    "rulings": "bh.analysis.rulings",
    "scan": "bh.applications.scan",
    "sensitivities": "bh.analysis.sensitivities",
    "stiffness_probe": "bh.analysis.stiffness_probe",
    "studio": "bh.studio",
    "sweep": "bh.sweep",
}

__all__ = [
    "Accuracy",
    "Actuation",
    "ArcLength",
    "AreaForce",
    "Automatic",
    "Bilinear",
    "Body",
    "Calibration",
    "Constraint",
    "Couple",
    "CreaseLaw",
    "Displace",
    "DisplacementControl",
    "EdgeMoment",
    "ElasticPlastic",
    "ElementStiffness",
    "Energy",
    "Expand",
    "Fold",
    "Force",
    "Formulation",
    "Goal",
    "GroundSpring",
    "HingeLaw",
    "Hold",
    "Indenter",
    "InputError",
    "LineForce",
    "LoadControl",
    "Measured",
    "Model",
    "ModelError",
    "Moment",
    "MomentTable",
    "Mould",
    "Newton",
    "NotReachedError",
    "NotReachedWarning",
    "Outcome",
    "Path",
    "PathFileError",
    "Pinch",
    "Pressure",
    "Pull",
    "RandomField",
    "Refinement",
    "Remark",
    "RigidBody",
    "Run",
    "Scanned",
    "SceneError",
    "Settling",
    "Sheet",
    "SheetSystem",
    "SheetZone",
    "Softening",
    "State",
    "Step",
    "StepBuilder",
    "Support",
    "Tether",
    "Until",
    "Weight",
    "Zone",
    "allow_outside",
    "allow_plugins",
    "calibrate",
    "depth",
    "imperfect",
    "laminate",
    "load_scene",
    "read",
    "remarks",
    "trace",
]


def _show(path: Path, **options: Any) -> Any:
    """What `path.plot()` does."""
    from bh.plotting.pictures import show

    return show(path[-1], **options)


_ensure_kernel_cache()
_viewer.use(_show)


def __getattr__(name: str) -> Any:
    """A name of the table, loaded now; a module under its short name; or the version."""
    if name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
        globals()[name] = value
        return value
    if name in _SUBMODULES:
        return import_module(_SUBMODULES[name])
    if name == "__version__":
        from importlib.metadata import version

        return version("curved-crease-workbench")
    raise AttributeError(f"module 'bh' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME, *_SUBMODULES])
