"""Case `fig5_9` (source 5.4.2): bending and twisting of pinched sheets with one to seven parallel creases."""

from __future__ import annotations

from typing import Any

from verification.framework.checks import CaseResult, Context
from verification.studies.ch5.pinching import (
    AS_SOURCE,
    CONVERGED,
    NEARLY,
    WAYS,
    Pinched,
    Way,
    add,
    angle_plots,
    pinched,
    reached,
)

NUMBERS = (1, 2, 3, 4, 5, 6, 7)
CURVATURES = (0.0, 0.005, 0.01)  # 1/mm
SOURCE = "source 5.4.2, Fig. 5.9"
Found = dict[tuple[str, tuple[int, int], int, float], Pinched]


def run(context: Context) -> CaseResult:
    """All numbers of creases and curvatures, both formulations, two meshes."""
    result = CaseResult(
        name="fig5_9",
        title="Pinched sheets with one to seven creases",
        question="How do bending and twisting depend on the number of creases?",
        source=SOURCE,
    )
    found: Found = {}
    for way in WAYS:
        for mesh in way.taken(context.quick):
            context.tell(f"fig5_9: {way.name}, {mesh[0]} x {mesh[1]}")
            for n in NUMBERS:
                for k in CURVATURES:
                    found[way.name, mesh, n, k] = pinched(way, mesh, k, n, left=NEARLY)
    reached(result, list(found.values()))
    for way in WAYS:
        for mesh in way.taken(context.quick):
            _angles(result, way, mesh, found)
            _claims(result, way, mesh, found)
    _plots(result, found)
    _pictures(result, context, found)
    _notes(result, found)
    return result


def _angles(result: CaseResult, way: Way, mesh: tuple[int, int], found: Found) -> None:
    finest = way.meshes[-1]
    for n in NUMBERS:
        for k in CURVATURES:
            p = found[way.name, mesh, n, k]
            fine = found.get((way.name, finest, n, k)) if mesh != finest else None
            params: dict[str, Any] = {
                "way": way.name, "along": mesh[0], "rows": mesh[1], "creases": n, "kappa_0_per_mm": k,
            }  # fmt: skip
            for name, value, other in (
                ("change of the bending angle", p.bend, None if fine is None else fine.bend),
                ("change of the twist angle", p.twist, None if fine is None else fine.twist),
            ):
                add(result, p, name, value, "deg", other, "the finer mesh of this formulation", **params)


def _claims(result: CaseResult, way: Way, mesh: tuple[int, int], found: Found) -> None:
    """What Fig. 5.9 is said to show: 1 if it holds."""
    get = {(n, k): found[way.name, mesh, n, k] for n in NUMBERS for k in CURVATURES}
    params: dict[str, Any] = {"way": way.name, "along": mesh[0], "rows": mesh[1]}
    odd, even = NUMBERS[::2], NUMBERS[1::2]
    judged = 0.0 if mesh == way.judged else None

    def claim(quantity: str, holds: bool, of_both: bool = True) -> None:
        """Those that hold with the source's model only are reported of the other one."""
        tolerance = judged if of_both or way is AS_SOURCE else None
        add(result, None, quantity, float(holds), "", 1.0, SOURCE, tolerance, **params)

    for most in (4, 7):
        claim(f"odd and even numbers up to {most} twist to opposite sides (kappa_0 > 0)",
              all(get[n, k].twist > 0.0 for n in odd for k in CURVATURES[1:] if n <= most)
              and all(get[n, k].twist < 0.0 for n in even for k in CURVATURES if n <= most), most == 4)  # fmt: skip
    claim("every even number twists more than its odd neighbours (kappa_0 = 0.005 /mm)",
          all(abs(get[n, 0.005].twist) > abs(get[m, 0.005].twist) for n in even for m in (n - 1, n + 1)))  # fmt: skip
    flat = max(abs(get[n, 0.0].twist) for n in odd)
    add(result, None, "largest twist of an odd number of straight creases", flat, "deg", 0.0, SOURCE + ": none",
        0.05 if judged is not None else None, **params)  # fmt: skip
    for name, numbers in (("odd", odd[1:]), ("even", even)):
        sizes = [abs(get[n, 0.01].twist) for n in numbers]
        claim(
            f"twist falls with the number of creases ({name}, from {numbers[0]})",
            sizes == sorted(sizes, reverse=True),
        )
    for k in CURVATURES[1:]:
        bends = [get[n, k].bend for n in NUMBERS]
        add(result, None, "largest bend of any number of creases over the smallest", max(bends) / min(bends), "", 1.0,
            SOURCE + ": not strongly related", kappa_0_per_mm=k, **params)  # fmt: skip
    ratio = sum(get[n, 0.01].bend / get[n, 0.005].bend for n in NUMBERS) / len(NUMBERS)
    add(
        result,
        None,
        "bend at 0.01 /mm over that at 0.005 /mm, mean",
        ratio,
        "",
        2.0,
        "proportional to kappa_0",
        **params,
    )


def _plots(result: CaseResult, found: Found) -> None:
    for way in WAYS:
        mesh = way.judged if (way.name, way.judged, 1, 0.0) in found else way.meshes[0]
        curves = {f"kappa_0 = {k:g} /mm": [found[way.name, mesh, n, k] for n in NUMBERS] for k in CURVATURES}
        caption = f"{way.formulation}, {mesh[0]} x {mesh[1]} cells a panel (Fig. 5.9)."
        angle_plots(result, "fig5-9", f", {way.name}", ("number of creases", NUMBERS), curves, caption,
                    f"-{way.formulation}")  # fmt: skip


def _pictures(result: CaseResult, context: Context, found: Found) -> None:
    from bh.plotting.pictures import picture

    context.folder.mkdir(parents=True, exist_ok=True)
    for n in (2, 3):
        file = f"fig5_9_{n}.png"
        p = found[WAYS[1].name, WAYS[1].meshes[0], n, 0.0]
        picture(
            p.path[-1],
            context.folder / file,
            colour=None,
            camera=(-0.6, 0.35),
            caption=f"{n} straight creases, pinched",
        )
        result.pictures.append(
            {"file": file, "alt": f"Sheet with {n} straight creases, pinched in the middle",
             "caption": f"{n} straight creases: the change of the twist angle is {p.twist:.1f} degrees (Fig. "
             "5.9 c, d)."}
        )  # fmt: skip


def _notes(result: CaseResult, found: Found) -> None:
    def values(way: Way, numbers: tuple[int, ...], k: float, read: str) -> str:
        mesh = max(m for name, m, *_ in found if name == way.name) if way is CONVERGED else way.judged
        return ", ".join(f"{getattr(found[way.name, mesh, n, k], read):.1f}" for n in numbers)

    for way in WAYS:
        result.notes.append(
            f"{way.name}, kappa_0 = 0.01 /mm: twist {values(way, NUMBERS[::2], 0.01, 'twist')} degrees (1, 3, 5, 7 "
            f"creases) and {values(way, NUMBERS[1::2], 0.01, 'twist')} (2, 4, 6); bend "
            f"{values(way, NUMBERS, 0.01, 'bend')} (1 to 7)."
        )
    result.notes.append(
        "Odd and straight: no twist. Even: far more, to the other side. Both formulations say so; from five "
        "creases on the converged twist of odd numbers is within a degree of nothing, of either sign. With straight "
        f"creases the twist of even numbers does not fade as the source says: "
        f"{values(CONVERGED, NUMBERS[1::2], 0.0, 'twist')} degrees "
        f"(2, 4, 6) once converged, {values(AS_SOURCE, NUMBERS[1::2], 0.0, 'twist')} with its model. Its model "
        "bends several times too much, because torsion of bars and hinges carries the pinch along the whole "
        "crease (case fig5_5)."
    )
