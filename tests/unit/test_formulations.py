"""What a formulation must have is looked at when it is registered; abilities are all or nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace

import pytest

import bh
import meshes
from bh.errors import ModelError
from bh.formulations import protocols, registry
from bh.formulations.protocols import Differentiable, Mirrored, NodalUnknowns, Refinable
from bh.formulations.registry import checked, checked_system, formulation, names
from bh.loading.builder import load_steps
from bh.mechanics.bars_and_hinges.formulation import BarsAndHinges
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem

SHEET = bh.Sheet(E=4000.0, t=0.127)
MESH = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=4)
REQUIRED = ("name", "takes_nu", "system", "observe", "remarks")


def all_of_it() -> SimpleNamespace:
    """Everything that is required, and no ability."""
    bars = BarsAndHinges()
    return SimpleNamespace(**{member: getattr(bars, member) for member in REQUIRED})


def test_what_is_required() -> None:
    assert registry.REQUIRED == REQUIRED
    assert checked(all_of_it(), "mine:All").name == "bars-and-hinges"


@pytest.mark.parametrize("member", REQUIRED)
def test_a_missing_member_is_named(member: str) -> None:
    found = all_of_it()
    delattr(found, member)
    with pytest.raises(ModelError) as caught:
        checked(found, "mine:Most")
    message = str(caught.value)
    assert "'mine:Most' has no " + member in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("member", "wrong"), [("observe", lambda model, system, q: None), ("system", 3), ("remarks", lambda: ())]
)
def test_a_member_that_takes_something_else_is_named(member: str, wrong: object) -> None:
    found = all_of_it()
    setattr(found, member, wrong)
    with pytest.raises(ModelError, match=rf"'mine:Odd': {member} cannot be called as {member}\(model"):
        checked(found, "mine:Odd")


def test_half_an_ability_is_named() -> None:
    found = all_of_it()
    found.half = BarsAndHinges().half
    with pytest.raises(ModelError, match="has half but no whole, part"):
        checked(found, "mine:Some")


def test_a_formulation_is_refused_before_anything_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    """By its name in a model: at the registry, not in the middle of a solve."""
    module = ModuleType("mine_without")
    module.NoStates = type("NoStates", (), {**vars(BarsAndHinges), "observe": None})  # type: ignore[attr-defined]
    module.Asks = lambda size: BarsAndHinges()  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "mine_without", module)
    model = bh.Model(MESH, SHEET, formulation="mine_without:NoStates").fold("crease", to=3.0)
    with pytest.raises(ModelError, match="observe cannot be called as observe"):
        bh.trace(model)
    with pytest.raises(ModelError, match="'mine_without:Asks' cannot be made without arguments"):
        formulation("mine_without:Asks")


def test_a_system_without_a_member_is_refused_before_its_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("bh.mechanics.shared.base_system.SupportedSheet.loads")
    with pytest.raises(ModelError, match="BarsAndHingesSystem without loads, which is no system"):
        bh.trace(bh.Model(MESH, SHEET, formulation="bars-and-hinges").fold("crease", to=3.0))


def test_what_a_system_has_to_offer() -> None:
    """The names that are looked for are those of both protocols."""
    driver = ("size", "primal", "evaluate", "tangent", "control_rate", "power", "objection", "obstacle")
    analyses = ("start", "positions", "vectors", "loads", "constraints", "control_stiffness")
    assert {*driver, *analyses} <= set(registry.OF_SYSTEM)
    model = bh.Model(MESH, SHEET).fold("crease", to=3.0)
    system = BarsAndHingesSystem(model, load_steps(model)[0], None)
    assert checked_system(system, "bars-and-hinges") is system


ABILITIES: dict[str, tuple[Callable[[object], bool], tuple[str, ...]]] = {
    "mirrored": (lambda item: isinstance(item, Mirrored), ("bars-and-hinges", "consistent")),
    "derivatives": (lambda item: isinstance(item, Differentiable), ("bars-and-hinges", "consistent")),
    "refinement": (lambda item: isinstance(item, Refinable), ("consistent", "shell")),
}


@pytest.mark.parametrize("ability", list(ABILITIES))
def test_who_can_what(ability: str) -> None:
    has, able = ABILITIES[ability]
    assert set(able) <= set(registry.able(has))
    assert not has(all_of_it())


def test_unknowns_of_nodes() -> None:
    """The shell has middle nodes too, so its unknowns are not those of the mesh's nodes."""
    for name, nodal in (("bars-and-hinges", True), ("consistent", True), ("shell", False)):
        model = bh.Model(MESH, SHEET, formulation=name).fold("crease", to=3.0)
        system = formulation(name).system(model, load_steps(model)[0], None)
        assert isinstance(system, NodalUnknowns) is nodal


def test_remarks_are_each_formulations_own() -> None:
    slender = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=2, kind="one-way")
    said = {
        name: [remark.code for remark in bh.remarks(bh.Model(slender, SHEET, formulation=name))]
        for name in names()
    }
    assert said["bars-and-hinges"] == ["crease", "aspect-ratio", "diagonals"]
    assert said["consistent"] == ["rows"]
    assert said["shell"] == []


def test_the_protocols_are_in_one_file() -> None:
    """A new formulation is written against one file: it names all that is asked for."""
    text = protocols.__doc__ or ""
    assert all(
        name in text for name in ("Formulation", "SheetSystem", "Mirrored", "Differentiable", "Refinable")
    )
