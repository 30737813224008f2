"""What a scene does not use costs nothing: no arrays, no unknowns and no imports of it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bh
import meshes
from bh.loading.builder import load_steps
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.mechanics.consistent.system import ConsistentSystem
from bh.solvers.matrices import BandMatrix

ROOT = Path(__file__).resolve().parents[2]
SHEET = bh.Sheet(E=4000.0, nu=0.3, t=0.127)
PULLED = """
import bh, meshes
mesh = meshes.structured(meshes.strip(40.0, 10.0), along=6)
model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="{formulation}")
model = model.support("edge:start").support("edge:end", "yz").displace("edge:end", "x", 0.01)
assert bh.trace(model).outcome == "reached"
"""


def pulled(creases: list[float]) -> bh.Model:
    mesh = meshes.structured(meshes.strip(40.0, 10.0, creases), along=6)
    model = (
        bh.Model(mesh, SHEET, formulation="bars-and-hinges").support("edge:start").support("edge:end", "yz")
    )
    return model.displace("edge:end", "x", 0.01)


def loaded_after(code: str) -> set[str]:
    script = f"{code}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_no_folding_arrays_without_creases() -> None:
    """A plain strip, and a creased one whose crease does nothing, have bending hinges only."""
    for creases in ([], [5.0]):
        model = pulled(creases)
        system = BarsAndHingesSystem(model, load_steps(model)[0], None)
        e = system.elements
        assert (e.spring, e.prescribed, e.bending) == (0, 0, len(model.mesh.topology.hinges))
        assert len(e.penalty) == 0
        assert system.size == system.primal == len(system.displacements.free)
        evaluation = system.evaluate(system.start(), 0.5)
        assert len(evaluation.forces) == len(e.bars) + e.bending
        assert isinstance(system.tangent(system.start(), 0.5, evaluation.forces).matrix, BandMatrix)
        assert system.rigid_contact is None


def test_folding_arrays_are_those_of_the_crease() -> None:
    """The other side: the test above can see them."""
    held, spring = pulled([5.0]).fold("crease", to=3.0), pulled([5.0]).fold("crease", rest=3.0, Lstar=10.0)
    for model, count in ((held, (0, 6)), (spring, (6, 0))):
        system = BarsAndHingesSystem(model, load_steps(model)[-1], None)
        assert (system.elements.spring, system.elements.prescribed) == count
        assert system.size == system.primal + count[1]


def test_consistent_has_springs_for_springs_only() -> None:
    """Two rotations an edge of a spring crease, one or none of the others; no multipliers for held angles."""
    plain, held = pulled([5.0]), pulled([5.0]).fold("crease", to=3.0)
    spring = pulled([5.0]).fold("crease", rest=3.0, Lstar=10.0)
    one, two, three = (ConsistentSystem(m, load_steps(m)[-1], None) for m in (plain, held, spring))
    assert len(one.elements.springs) == len(two.elements.springs) == 0
    assert one.elements.turns.shape == two.elements.turns.shape == (0, 2)
    assert len(three.elements.springs) == 6
    assert one.size == two.size == two.primal < three.size
    assert one.elements.rotations < len(plain.mesh.topology.hinges)


def test_no_rotations_without_the_consistent_formulation() -> None:
    """Bars and hinges load neither the other formulations nor what is asked for apart."""
    loaded = loaded_after(PULLED.format(formulation="bars-and-hinges"))
    assert "bh.mechanics.bars_and_hinges.system" in loaded
    assert not loaded & {
        "bh.solving.accuracy",
        "bh.formulations.symmetry_reduction",
        "bh.loading.symmetry",
        "bh.mechanics.shared.mirrored",
        "bh.model.refinement",
        "bh.scene.load",
    }
    others = (
        "bh.mechanics.consistent",
        "bh.mechanics.contact",
        "fem",
        "skfem",
        "ipctk",
        "bh.analysis",
    )
    look = {"bh.analysis", *(f"bh.analysis.{name}" for name in ("contact", "projection", "triangles"))}
    assert not [
        name for name in loaded - look if name.startswith(others)
    ]  # whether it meets itself is looked at


def test_the_consistent_formulation_loads_no_shell() -> None:
    loaded = loaded_after(PULLED.format(formulation="consistent"))
    assert "bh.mechanics.consistent.system" in loaded
    assert not [name for name in loaded if name.split(".")[0] in ("fem", "skfem", "gmsh", "pydantic")]
    assert not loaded & {
        "bh.solving.accuracy",
        "bh.formulations.symmetry_reduction",
        "bh.loading.symmetry",
        "bh.mechanics.consistent.half",
    }


def test_what_is_asked_for_is_loaded() -> None:
    """The tests above would see it."""
    code = (
        "import bh, meshes\n"
        "mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=4)\n"
        "bh.trace(bh.Model(mesh, bh.Sheet(E=4000.0, t=0.1)).fold('crease', to=3.0), symmetry='y')"
    )
    assert {
        "bh.formulations.symmetry_reduction",
        "bh.loading.symmetry",
        "bh.mechanics.shared.mirrored",
    } <= loaded_after(code)
