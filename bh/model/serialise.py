"""A model as plain data and back: JSON for what is small, arrays for what is long. Used to store and to hash inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bh.errors import PathFileError
from bh.formulations.observables import Until
from bh.model.actuations import Actuation, Bar, Displace, Fold, Force, Moment, Pinch, Tether
from bh.model.model import CreaseLaw, ElementStiffness, Model, Sheet
from bh.model.plugins import named
from bh.model.supports import Holding, RigidBody, Support
from meshes import Arc, ArcChain, Line, Polyline, SheetMesh
from meshes.curves import Curve

AnyArray = NDArray[Any]
ACTUATIONS: dict[str, type[Actuation]] = {
    "fold": Fold,
    "pinch": Pinch,
    "moment": Moment,
    "force": Force,
    "displace": Displace,
}
CURVES: dict[str, type[Curve]] = {"line": Line, "arc": Arc, "arc-chain": ArcChain, "polyline": Polyline}
STEP_ITEMS: dict[str, type[Actuation | Until]] = {
    **ACTUATIONS,
    "bar": Bar,
    "tether": Tether,
    "until": Until,
}
FORMAT = 1


def describe(model: Model) -> tuple[dict[str, Any], dict[str, AnyArray]]:
    """(data, arrays): everything a model consists of; `data` can be written as JSON."""
    mesh = model.mesh
    arrays: dict[str, AnyArray] = {"points": mesh.points, "triangles": mesh.triangles}
    if mesh.spans is not None:
        arrays["spans"] = mesh.spans
    if model.stiffness is not None:
        arrays |= {"stiffness/bars": model.stiffness.bars, "stiffness/hinges": model.stiffness.hinges}
    arrays |= {f"edges/{name}": pairs for name, pairs in mesh.edge_sets.items()}
    arrays |= {f"angles/{name}": angles for name, angles in mesh.fold_angles.items()}
    data = {
        "format": FORMAT,
        "formulation": model.formulation,
        "hinge_lock": model.hinge_lock,
        "green": model.stiffness is not None and model.stiffness.green,
        "sheet": _plain(model.sheet),
        "mesh": {
            "corners": dict(mesh.corners),
            "folds": dict(mesh.folds),
            "kind": mesh.kind,
            "aspect_ratio": None if np.isnan(mesh.aspect_ratio) else mesh.aspect_ratio,
            "curves": {name: _tagged(curve, CURVES) for name, curve in mesh.curves.items()},
            **({"remarks": list(mesh.remarks)} if mesh.remarks else {}),
        },
        "supports": [_support(s) for s in model.supports],
        "creases": {name: _plain(law) for name, law in model.creases.items()},
        "steps": [[_tagged(item, STEP_ITEMS) for item in step] for step in model.steps],
    }
    return data, arrays


def rebuild(data: Mapping[str, Any], arrays: Mapping[str, AnyArray]) -> Model:
    """The model that `describe` described.

    Raises:
        PathFileError: the data are of another version or incomplete.
    """
    if data.get("format") != FORMAT:
        raise PathFileError(
            f"stored model has format {data.get('format')}, this version reads {FORMAT}; solve again"
        )
    try:
        flat = data["mesh"]
        sets = {name.removeprefix("edges/"): a for name, a in arrays.items() if name.startswith("edges/")}
        angles = {name.removeprefix("angles/"): a for name, a in arrays.items() if name.startswith("angles/")}
        mesh = SheetMesh(
            points=arrays["points"], triangles=arrays["triangles"], edge_sets=sets, corners=flat["corners"],
            folds=flat["folds"], fold_angles=angles, spans=arrays.get("spans"), kind=flat["kind"],
            curves={name: _untagged(curve, CURVES) for name, curve in flat["curves"].items()},
            aspect_ratio=float("nan") if flat["aspect_ratio"] is None else flat["aspect_ratio"],
            remarks=tuple(flat.get("remarks", ())),
        )  # fmt: skip
        return Model(
            mesh=mesh,
            sheet=Sheet(**data["sheet"]),
            supports=tuple(_held(s) for s in data["supports"]),
            steps=tuple(tuple(_untagged(item, STEP_ITEMS) for item in step) for step in data["steps"]),
            creases={name: CreaseLaw(**law) for name, law in data["creases"].items()},
            formulation=data["formulation"],
            stiffness=ElementStiffness(arrays["stiffness/bars"], arrays["stiffness/hinges"], data["green"])
            if "stiffness/bars" in arrays
            else None,
            hinge_lock=data.get("hinge_lock", False),  # files of versions that had no lock
        )
    except (KeyError, TypeError) as missing:
        raise PathFileError(f"the stored model is incomplete ({missing}); solve again") from missing


def fingerprint(model: Model) -> str:
    """SHA-256 of everything a model consists of (hex)."""
    data, arrays = describe(model)
    digest = hashlib.sha256(json.dumps(data, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _plain(item: Any) -> dict[str, Any]:
    return {f.name: _jsonable(getattr(item, f.name)) for f in fields(item)}


def _tagged(item: Any, kinds: Mapping[str, type]) -> dict[str, Any]:
    """Fields and kind; a class of the user's own is "module:Class"."""
    own = f"{type(item).__module__}:{type(item).__qualname__}"
    return {"kind": next((name for name, cls in kinds.items() if type(item) is cls), own), **_plain(item)}


def _untagged(data: Mapping[str, Any], kinds: Mapping[str, type]) -> Any:
    rest = {key: value for key, value in data.items() if key != "kind"}
    if data["kind"] == "polyline":
        rest["vertices"] = np.asarray(rest["vertices"])
    for key in ("start", "end", "centre", "curvatures", "lengths"):
        if isinstance(rest.get(key), list):
            rest[key] = tuple(rest[key])
    if ":" not in data["kind"]:
        return kinds[data["kind"]](**rest)
    lists = {key: tuple(value) if isinstance(value, list) else value for key, value in rest.items()}
    return named(data["kind"])(**lists)


def _support(item: Holding) -> Any:
    if isinstance(item, RigidBody):
        return "rigid-body"
    return _plain(item) if type(item) is Support else _tagged(item, {})


def _held(data: Any) -> Holding:
    if data == "rigid-body":
        return RigidBody()
    held: Holding = _untagged(data, {}) if "kind" in data else Support(**data)
    return held


def _jsonable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple | list):
        return [_jsonable(item) for item in value]
    return value
