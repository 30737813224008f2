"""What `result.json` says about a solved scene."""

from __future__ import annotations

from bh.analysis.contact import Contact
from bh.analysis.yielding import Yielding
from bh.formulations.stress import Extreme
from bh.paths.path import Path as Trace
from bh.scene.load import Scene


def result(
    path: Trace, scene: Scene, contact: Contact | None, yields: Yielding | str | None = None
) -> dict[str, object]:
    """The content of result.json; energies in N mm, angles in rad; `contact` is the path's first self-contact.

    Args:
        path: solved, as far as it goes.
        scene: that it is of.
        contact: the path's first self-contact, if any.
        yields: when and where the sheet yields, or why that cannot be told; None where its strength is not given.
    """
    model = path.model
    mesh, last = model.mesh, path[-1]
    folds = {crease: last.fold_angle(crease) for crease in mesh.drawn_creases}
    steps = []
    for number in range(len(model.steps)):
        records = [record for record in path.records if record.step == number]
        tried = number < len(path.steps)
        steps.append(
            {
                "outcome": path.steps[number].outcome if tried else "not tried",
                "reason": path.steps[number].reason if tried else "an earlier step ended early",
                "states": len(records),
                "iterations": sum(record.iterations for record in records),
            }
        )
    return {
        "outcome": path.outcome,
        "reason": path.reason,
        "stable": path.stable,
        "remarks": path.remarks,
        "critical_points": [
            {
                "step": step,
                "kind": c.kind,
                "lambda": c.lam,
                "error": c.error,
                "negative_modes": list(c.negative),
            }
            for step, c in path.critical_points
        ],
        "energy": {kind: _number(value) for kind, value in last.energy.as_dict().items()},
        "lock_energy": _number(last.energy.lock),
        "spring_energy": _number(last.energy.ground),
        "contact_energy": _number(last.energy.contact),
        "dissipated": _number(last.energy.dissipated),
        "friction_energy": _number(last.energy.friction),
        "press": {name: [_number(f) for f in force] for name, force in last.contact_forces.items()},
        "fold_angle": {
            crease: {"mean": _number(a.mean()), "min": _number(a.min()), "max": _number(a.max())}
            for crease, a in folds.items()
            if len(a)
        },
        "self_contact": _contact(path, contact),
        "yield": _yield(yields),
        "steps": steps,
        "iterations": path.iterations,
        "wall_time_s": path.wall_time_s,
        "unknowns": path.unknowns,
        "mesh": {
            "nodes": len(mesh.points),
            "triangles": len(mesh.triangles),
            "aspect_ratio": _number(mesh.aspect_ratio),
        },
        "formulation": model.formulation,
        "accuracy": path.accuracy.as_dict() if path.accuracy is not None else None,
        "no_estimate": path.estimate_reason or None,
        "versions": path.provenance["versions"],
        "input": path.provenance["input"],
        "scene": str(scene.source),
    }


def _contact(path: Trace, contact: Contact | None) -> dict[str, object]:
    """Whether the sheet passes through itself, and where first; of very many triangle pairs the first hundred."""
    found: dict[str, object] = {"found": contact is not None, "states": len(path)}
    if contact is not None:
        found |= {
            "about": "reported, not prevented: from this state on the sheet passes through itself",
            "state": contact.state,
            "step": contact.step,
            "lambda": contact.lam,
            "panels": [list(pair) for pair in contact.panels],
            "triangle_pairs": len(contact.triangles),
            "triangles": contact.triangles[:100].tolist(),
        }
    return found


def _yield(yields: Yielding | str | None) -> dict[str, object] | None:
    if yields is None or isinstance(yields, str):
        return None if yields is None else {"unknown": yields}

    def place(found: Extreme) -> dict[str, object]:
        return {
            "utilisation": found.utilisation,
            "side": found.side,
            "triangle": found.triangle,
            "place": found.place.tolist(),
        }

    out: dict[str, object] = {
        "found": yields.first is not None,
        "largest": place(yields.largest) | {"state": yields.state},
    }
    if yields.first is not None:
        out["first"] = place(yields.first) | {"step": yields.step, "lambda": yields.lam}
    return out


def _number(value: float) -> float | None:
    """A number that JSON can hold; there is none for nan."""
    return float(value) if abs(value) < float("inf") else None
