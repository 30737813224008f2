"""What differs between a stored model and another one, by the keys that a scene has for it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import zip_longest
from typing import cast

import numpy as np

from bh.model.model import Model
from bh.model.serialise import AnyArray, describe

Data = Mapping[str, object]
CHOSEN = ("mesh", "formulation")  # by a run to an accuracy, whatever the scene has there
MOST = 5  # keys in a message


def differing_keys(
    data: Data, arrays: Mapping[str, AnyArray], model: Model, chosen: bool = False
) -> list[str]:
    """Keys by which a stored model differs from another one: "sheet.t = 0.1, now 0.2", "steps[1]".

    Args:
        data: plain data of the stored model.
        arrays: its arrays by name.
        model: the other one.
        chosen: mesh and formulation were chosen, and are no keys.

    Returns:
        the keys in the order of the description, none where the models are the same.
    """
    now, new = describe(model)
    now = json.loads(json.dumps(now))
    if chosen:
        same_curves = cast("Data", data["mesh"])["curves"] == now["mesh"]["curves"]
        found = [] if same_curves else ["pattern"]
    else:
        found = (
            [] if _same_mesh(cast("Data", data["mesh"]), arrays, now["mesh"], new) else ["pattern or mesh"]
        )
    for key in (
        "formulation",
        "sheet",
        "zones",
        "supports",
        "creases",
        "steps",
        "hinge_lock",
        "contact",
        "green",
    ):
        if not (chosen and key in CHOSEN):
            found += _differing(key, data.get(key), now.get(key))
    return found


def first_differing_step(keys: list[str]) -> int | None:
    """Number of the first step that differs where nothing but steps does, else None.

    Args:
        keys: of `differing_keys`.
    """
    numbers = [int(key[6 : key.index("]")]) for key in keys if key.startswith("steps[")]
    return min(numbers) if keys and len(numbers) == len(keys) else None


def in_words(keys: list[str]) -> str:
    """Keys for a message, the first few of them."""
    more = f" and {len(keys) - MOST} more" if len(keys) > MOST else ""
    return ", ".join(keys[:MOST]) + more


def _same_mesh(
    one: Data,
    stored: Mapping[str, AnyArray],
    other: Data,
    new: Mapping[str, AnyArray],
) -> bool:
    remarks = ({key: value for key, value in each.items() if key != "remarks"} for each in (one, other))
    first, second = remarks
    return (
        first == second
        and stored.keys() == new.keys()
        and all(np.array_equal(stored[name], new[name], equal_nan=True) for name in new)
    )


def _differing(at: str, old: object, new: object) -> list[str]:
    """Dotted keys below `at` whose values differ."""
    if old == new:
        return []
    if isinstance(old, dict) and isinstance(new, dict) and old.get("kind") == new.get("kind"):
        keys = dict.fromkeys((*old, *new))
        return [each for key in keys for each in _differing(f"{at}.{key}", old.get(key), new.get(key))]
    if isinstance(old, list) and isinstance(new, list) and _of_words((*old, *new)):
        pairs = enumerate(zip_longest(old, new))
        if at == "steps":
            return [f"steps[{i}]{_what(a, b)}" for i, (a, b) in pairs if a != b]
        return [each for i, (a, b) in pairs for each in _differing(f"{at}[{i}]", a, b)]
    return [f"{at} = {_shown(old)}, now {_shown(new)}"]


def _of_words(items: tuple[object, ...]) -> bool:
    """True where a list is one of things, not of numbers."""
    return any(isinstance(each, dict | str) for each in items)


def _what(old: object, new: object) -> str:
    """What is different in a step, shortly: the key where it is one, else nothing."""
    if old is None or new is None:
        return " (added)" if old is None else " (removed)"
    before, after = cast("Data", old), cast("Data", new)
    were, are = (cast("list[Data]", each["actuations"]) for each in (before, after))
    if len(were) != len(are):
        return ""
    acts = zip(were, are, strict=True)
    keys = [key for a, b in acts for key in _differing(f".{a.get('kind')}", a, b)]
    for key in ("until", "support", "release"):
        keys += _differing(f".{key}", before.get(key), after.get(key))
    return keys[0] if len(keys) == 1 else ""


def _shown(value: object) -> str:
    text = json.dumps(value) if value is not None else "nothing"
    return text if len(text) <= 40 else text[:36] + " ..."
