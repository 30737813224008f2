"""Bar-and-hinge simulation of sheets folded along curved creases.

Everything below is loaded when it is first used, so that `import bh` is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bh.kernel_cache import ensure as _ensure_kernel_cache

if TYPE_CHECKING:
    from bh.accuracy import Accuracy
    from bh.actuation import Bar, Displace, Fold, Force, Moment, Pinch, Tether
    from bh.errors import InputError, ModelError, PathFileError, SceneError
    from bh.model import CreaseLaw, Model, Sheet
    from bh.observables import Until, depth
    from bh.path import Path
    from bh.refinement import Goal
    from bh.scene import load_scene
    from bh.solvers.arc_length import ArcLength, DisplacementControl
    from bh.solvers.automatic import Automatic
    from bh.solvers.continuation import LoadControl
    from bh.solvers.newton import Newton
    from bh.state import Energy, State
    from bh.supports import RigidBody, Support
    from bh.tracing import trace

_HOME = {
    "Accuracy": "bh.accuracy", "ArcLength": "bh.solvers.arc_length", "Automatic": "bh.solvers.automatic",
    "Bar": "bh.actuation", "CreaseLaw": "bh.model", "Tether": "bh.actuation",
    "Displace": "bh.actuation", "DisplacementControl": "bh.solvers.arc_length", "Energy": "bh.state",
    "Fold": "bh.actuation",
    "Force": "bh.actuation", "Goal": "bh.refinement", "InputError": "bh.errors",
    "LoadControl": "bh.solvers.continuation",
    "Model": "bh.model", "ModelError": "bh.errors", "Moment": "bh.actuation", "Newton": "bh.solvers.newton",
    "Path": "bh.path", "PathFileError": "bh.errors", "Pinch": "bh.actuation",
    "RigidBody": "bh.supports", "SceneError": "bh.errors",
    "Sheet": "bh.model", "State": "bh.state", "Until": "bh.observables", "depth": "bh.observables",
    "Support": "bh.supports", "load_scene": "bh.scene", "trace": "bh.tracing",
}  # fmt: skip

_SUBMODULES = {
    "contact": "bh.analysis.contact", "corrugation": "bh.applications.corrugation",
    "creases": "bh.analysis.creases", "interactive": "bh.interactive",
    "isometric": "bh.analysis.isometric",
    "node_sensitivities": "bh.analysis.node_sensitivities", "pinching": "bh.applications.pinching",
    "plotting": "bh.plotting", "polish": "bh.analysis.polish", "scan": "bh.scan",
    "rulings": "bh.analysis.rulings",
    "sensitivities": "bh.analysis.sensitivities",
    "stiffness_probe": "bh.analysis.stiffness_probe", "sweep": "bh.sweep",
}  # fmt: skip

__all__ = [
    "Accuracy", "ArcLength", "Automatic", "Bar", "CreaseLaw", "Displace", "DisplacementControl", "Energy", "Fold",
    "Force", "Goal", "InputError", "LoadControl", "Model", "ModelError", "Moment",
    "Newton", "Path", "PathFileError", "Pinch", "RigidBody", "SceneError", "Sheet", "State", "Support", "Tether",
    "Until", "depth", "load_scene", "trace",
]  # fmt: skip

_ensure_kernel_cache()


def __getattr__(name: str) -> Any:
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
    return sorted([*globals(), *_HOME])
