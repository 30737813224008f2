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
from bh.model.actuations import Displace, Fold, Force, Indenter, Moment, Pull, Tether
from bh.model.crease_law import CreaseLaw
from bh.model.growth import Expand
from bh.model.hinge_laws import LAWS, HingeLaw
from bh.model.loads import AreaForce, Couple, EdgeMoment, LineForce, Pressure
from bh.model.model import Model
from bh.model.mould import Mould
from bh.model.pinch import Pinch
from bh.model.plugins import consent, from_file
from bh.model.sheet import ElementStiffness, Sheet
from bh.model.springs import GroundSpring
from bh.model.step import Actuation, Step
from bh.model.supports import Constraint, Hold, RigidBody, Support
from bh.model.until import Until
from bh.model.weight import Weight
from bh.model.zones import SheetZone
from bh.runtime.consent import said
from meshes import Arc, ArcChain, Line, Polyline, SheetMesh
from meshes.curves import Curve

AnyArray = NDArray[Any]
ACTUATIONS: dict[str, type[Actuation]] = {
    "fold": Fold,
    "pinch": Pinch,
    "moment": Moment,
    "force": Force,
    "displace": Displace,
    "pull": Pull,
    "weight": Weight,
    "pressure": Pressure,
    "line_force": LineForce,
    "area_force": AreaForce,
    "edge_moment": EdgeMoment,
    "couple": Couple,
    "expand": Expand,
}
CURVES: dict[str, type[Curve]] = {"line": Line, "arc": Arc, "arc-chain": ArcChain, "polyline": Polyline}
SUPPORTS: dict[str, type[Constraint]] = {"hold": Hold}
STEP_ITEMS: dict[str, type[Actuation]] = {
    **ACTUATIONS,
    "indenter": Indenter,
    "tether": Tether,
    "mould": Mould,
}
FORMAT = 2  # raised with every change of the description


def describe(model: Model) -> tuple[dict[str, Any], dict[str, AnyArray]]:
    """(data, arrays): everything a model consists of; `data` can be written as JSON."""
    mesh = model.mesh
    arrays: dict[str, AnyArray] = {"points": mesh.points, "triangles": mesh.triangles}
    if mesh.drawn is not None and mesh.curves and not np.array_equal(mesh.drawn, mesh.points):
        arrays["drawn"] = mesh.drawn
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
        **({"contact": model.contact} if model.stops_itself else {}),
        **({"friction": model.friction} if model.friction else {}),
        "green": model.stiffness is not None and model.stiffness.green,
        "sheet": _sheet(model.sheet),
        **({"zones": [_zone(zone) for zone in model.zones]} if model.zones else {}),
        "mesh": {
            "corners": dict(mesh.corners),
            "folds": dict(mesh.folds),
            "kind": mesh.kind,
            "aspect_ratio": None if np.isnan(mesh.aspect_ratio) else mesh.aspect_ratio,
            "curves": {name: _tagged(curve, CURVES) for name, curve in mesh.curves.items()},
            **({"remarks": list(mesh.remarks)} if mesh.remarks else {}),
        },
        "supports": [_support(s) for s in model.supports],
        "creases": {name: _crease(law) for name, law in model.creases.items()},
        "steps": [_step(step) for step in model.steps],
        **({"springs": [_plain(item) for item in model.springs]} if model.springs else {}),
    }
    return data, arrays


def rebuild(data: Mapping[str, Any], arrays: Mapping[str, AnyArray]) -> Model:
    """The model that `describe` described.

    Args:
        data: plain data of the model.
        arrays: its arrays by name.

    Raises:
        PathFileError: the data are of another version or incomplete.
        ModelError: they name code that nobody has allowed to run.
    """
    if data.get("format") != FORMAT:
        raise PathFileError(
            f"stored model has format {data.get('format')}, this version reads {FORMAT}; make it anew "
            "from its scene or script"
        )
    try:
        flat = data["mesh"]
        sets = {name.removeprefix("edges/"): a for name, a in arrays.items() if name.startswith("edges/")}
        angles = {name.removeprefix("angles/"): a for name, a in arrays.items() if name.startswith("angles/")}
        mesh = SheetMesh(
            points=arrays["points"], triangles=arrays["triangles"], edge_sets=sets, corners=flat["corners"],
            folds=flat["folds"], fold_angles=angles, spans=arrays.get("spans"), kind=str(flat["kind"]),
            curves={name: _untagged(curve, CURVES) for name, curve in flat["curves"].items()},
            aspect_ratio=float("nan" if flat["aspect_ratio"] is None else flat["aspect_ratio"]),
            remarks=tuple(flat.get("remarks", ())), drawn=arrays.get("drawn"),
        )  # fmt: skip
        return Model(
            mesh=mesh,
            sheet=Sheet(**data["sheet"]),
            zones=tuple(SheetZone(zone["where"], Sheet(**zone["sheet"])) for zone in data.get("zones", ())),
            supports=tuple(_constraint(s) for s in data["supports"]),
            steps=tuple(_stored_step(step) for step in data["steps"]),
            creases={name: _stored_crease(law) for name, law in data["creases"].items()},
            formulation=_agreed(data["formulation"]),
            stiffness=ElementStiffness(arrays["stiffness/bars"], arrays["stiffness/hinges"], data["green"])
            if "stiffness/bars" in arrays
            else None,
            hinge_lock=data.get("hinge_lock", False),  # files of versions that had no lock
            contact=data.get("contact", False),
            friction=data.get("friction", 0.0),
            springs=tuple(GroundSpring(**item) for item in data.get("springs", ())),
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


def _sheet(sheet: Sheet) -> dict[str, object]:
    found = {name: value for name, value in _plain(sheet).items() if value is not None and name != "plies"}
    return found if sheet.plies is None else {**found, "plies": [_sheet(ply) for ply in sheet.plies]}


def _zone(zone: SheetZone) -> dict[str, object]:
    return {"where": _jsonable(zone.where), "sheet": _sheet(zone.sheet)}


def _crease(crease: CreaseLaw) -> dict[str, object]:
    found = {
        key: value for key, value in vars(crease).items() if key != "law"
    }  # fingerprints as ever without one
    return found if crease.law is None else {**found, "law": law_data(crease.law)}


def _stored_crease(data: Mapping[str, Any]) -> CreaseLaw:
    law = data.get("law")
    return CreaseLaw(**{**data, "law": None if law is None else stored_law(law)})


def law_data(law: HingeLaw) -> dict[str, object]:
    """Plain data of a law, which `stored_law` makes it from again.

    Args:
        law: one of `LAWS`, or the user's own.

    Returns:
        its keys and a `kind`.
    """
    return _tagged(law, LAWS)


def stored_law(data: Mapping[str, object]) -> HingeLaw:
    """The law that keys and a `kind` describe; "module:Class" is one of the user's own.

    Args:
        data: plain data.

    Raises:
        ModelError: it names code that nobody has allowed to run.
    """
    law: HingeLaw = _untagged(data, LAWS, HingeLaw)
    return law


def _tagged(item: Any, kinds: Mapping[str, type]) -> dict[str, Any]:
    """Fields and kind; a class of the user's own is "module:Class"."""
    kind = next((name for name, cls in kinds.items() if type(item) is cls), None)
    if kind is None:
        kind = f"{type(item).__module__}:{type(item).__qualname__}"
        said(kind)  # it is there as an object, so its name may be read again
    return {"kind": kind, **_plain(item)}


def _untagged(data: Mapping[str, Any], kinds: Mapping[str, type], kind: type | None = None) -> Any:
    rest = {key: value for key, value in data.items() if key != "kind"}
    if data["kind"] == "polyline":
        rest["vertices"] = np.asarray(rest["vertices"])
    for key in ("start", "end", "centre", "curvatures", "lengths"):
        if isinstance(rest.get(key), list):
            rest[key] = tuple(rest[key])
    if ":" not in data["kind"]:
        return kinds[data["kind"]](**rest)
    lists = {key: tuple(value) if isinstance(value, list) else value for key, value in rest.items()}
    return from_file(data["kind"], kind)(**lists)


def _step(step: Step) -> dict[str, object]:
    actuations = [_tagged(item, STEP_ITEMS) for item in step.actuations]
    for item in actuations:  # models of versions without it keep their fingerprint
        for key in ("further", "friction"):
            if item.get(key, 0.0) is None:
                del item[key]
    found: dict[str, object] = {
        "actuations": actuations,
        "until": None if step.until is None else _plain(step.until),
    }
    if step.support:
        found["support"] = [_support(item) for item in step.support]
    if step.release:
        found["release"] = [
            {"support": _support(item)} if isinstance(item, Constraint) else _jsonable(item)
            for item in step.release
        ]
    return found


def _stored_step(data: Mapping[str, Any]) -> Step:
    if data["until"] is not None:
        _agreed(data["until"]["observable"])
    until = None if data["until"] is None else Until(**data["until"])
    return Step(
        tuple(_untagged(item, STEP_ITEMS, Actuation) for item in data["actuations"]),
        until,
        tuple(_constraint(item) for item in data.get("support", ())),
        tuple(
            _constraint(item["support"])
            if isinstance(item, dict)
            else item
            if isinstance(item, str)
            else tuple(item)
            for item in data.get("release", ())
        ),
    )


def _agreed(name: str) -> str:
    """A name from a file that may be one of the user's own code."""
    if ":" in name:
        consent(name)
    return name


def _support(item: Constraint) -> Any:
    if isinstance(item, RigidBody):
        return "rigid-body"
    return _plain(item) if type(item) is Support else _tagged(item, SUPPORTS)


def _constraint(data: Any) -> Constraint:
    if data == "rigid-body":
        return RigidBody()
    found: Constraint = _untagged(data, SUPPORTS, Constraint) if "kind" in data else Support(**data)
    return found


def _jsonable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple | list):
        return [_jsonable(item) for item in value]
    return value
