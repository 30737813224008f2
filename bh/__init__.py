"""Bar-and-hinge simulation of sheets folded along curved creases.

Everything below is loaded when it is first used, so that `import bh` is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bh.runtime.kernel_cache import ensure as _ensure_kernel_cache

if TYPE_CHECKING:
    from bh.errors import InputError, ModelError, PathFileError, SceneError
    from bh.formulations.observables import Until, depth
    from bh.formulations.state import Energy, State
    from bh.model.actuations import Bar, Displace, Fold, Force, Moment, Pinch, Tether
    from bh.model.model import CreaseLaw, Model, Sheet
    from bh.model.refinement import Goal
    from bh.model.supports import RigidBody, Support
    from bh.paths.estimate import Accuracy
    from bh.paths.path import Path
    from bh.scene.load import load_scene
    from bh.solvers.arc_length import ArcLength, DisplacementControl
    from bh.solvers.automatic import Automatic
    from bh.solvers.continuation import LoadControl
    from bh.solvers.newton import Newton
    from bh.solving.follow import trace

_HOME = {
    "Accuracy": "bh.paths.estimate", "ArcLength": "bh.solvers.arc_length", "Automatic": "bh.solvers.automatic",
    "Bar": "bh.model.actuations", "CreaseLaw": "bh.model.model", "Tether": "bh.model.actuations",
    "Displace": "bh.model.actuations", "DisplacementControl": "bh.solvers.arc_length", "Energy": "bh.formulations.state",
    "Fold": "bh.model.actuations",
    "Force": "bh.model.actuations", "Goal": "bh.model.refinement", "InputError": "bh.errors",
    "LoadControl": "bh.solvers.continuation",
    "Model": "bh.model.model", "ModelError": "bh.errors", "Moment": "bh.model.actuations", "Newton": "bh.solvers.newton",
    "Path": "bh.paths.path", "PathFileError": "bh.errors", "Pinch": "bh.model.actuations",
    "RigidBody": "bh.model.supports", "SceneError": "bh.errors",
    "Sheet": "bh.model.model", "State": "bh.formulations.state", "Until": "bh.formulations.observables", "depth": "bh.formulations.observables",
    "Support": "bh.model.supports", "load_scene": "bh.scene.load", "trace": "bh.solving.follow",
}  # fmt: skip

_SUBMODULES = {
    "contact": "bh.analysis.contact", "corrugation": "bh.applications.corrugation",
    "creases": "bh.analysis.creases", "interactive": "bh.plotting.interactive",
    "isometric": "bh.analysis.isometric",
    "node_sensitivities": "bh.analysis.node_sensitivities", "pinching": "bh.applications.pinching",
    "plotting": "bh.plotting", "polish": "bh.applications.polish", "scan": "bh.applications.scan",
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
