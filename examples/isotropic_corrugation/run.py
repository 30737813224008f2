"""An isotropic corrugation: crease curves of one sheet that are stiff in bending in every direction.

    python examples/isotropic_corrugation/run.py

Searches the family of `meshes.curved_corrugation` at one area and depth (three minutes), prints the front of
weakest-direction stiffness against isotropy, and writes front.png, stiffness.png and folded.png beside itself.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import bh
from bh.applications.corrugation.design import Candidate, Design, Front, Task, pareto

SOURCE = {  # the four curved patterns of the source, for comparison
    "parabolic-point": Design(2.0, 1.0, 1.0, 5),
    "parabolic-edge": Design(2.0, 1.0, 0.0, 5),
    "elliptical-point": Design(2.0, 2.0, 1.0, 5),
    "elliptical-edge": Design(2.0, 2.0, 0.0, 5),
}


def main(population: int = 24, generations: int = 5, folder: Path = Path(__file__).parent) -> Front:
    """Search, print and draw; returns the front."""
    task = Task()
    front = pareto(task, population=population, generations=generations, known=tuple(SOURCE.values()))
    known = {name: task.simulate(design) for name, design in SOURCE.items()}
    print(f"{'design':52s} weakest (N/mm)  isotropy  k_x / k_y")
    for name, item in known.items():
        print(f"{name:52s} {item.weakest:14.2f} {item.isotropy:9.3f} {item.ratio:10.3f}")
    for item in front.best:
        print(f"{_words(item.design):52s} {item.weakest:14.2f} {item.isotropy:9.3f} {item.ratio:10.3f}")
    _draw(front, known, folder)
    return front


def _words(design: Design) -> str:
    return (
        f"p = {design.exponent:.2f}, q = {design.root:.2f}, s = {design.spread:.2f}, {design.panels} panels"
    )


def _draw(front: Front, known: dict[str, Candidate], folder: Path) -> None:
    import matplotlib.pyplot as plt

    best = front.best[-1]
    plt.figure(figsize=(5, 4))
    plt.plot([c.isotropy for c in front.candidates], [c.weakest for c in front.candidates], ".", color="0.7")
    plt.plot([c.isotropy for c in front.best], [c.weakest for c in front.best], "o-", label="Pareto front")
    for name, item in known.items():
        plt.plot(item.isotropy, item.weakest, "s", label=name)
    plt.xlabel("isotropy, least over largest stiffness")
    plt.ylabel("stiffness in the weakest direction (N/mm)")
    plt.legend(fontsize=7)
    plt.savefig(folder / "front.png", dpi=120, bbox_inches="tight")
    plt.figure(figsize=(4.5, 4.5))
    axes = plt.subplot(projection="polar")
    for name, item in {**known, "best": best}.items():
        if item.bending is not None:
            azimuth = np.append(item.bending.azimuth, item.bending.azimuth + np.pi)
            turn = np.append(azimuth, azimuth[0])
            radius = np.append(np.tile(item.bending.stiffness, 2), item.bending.stiffness[0])
            axes.plot(turn, radius, label=name, lw=2.5 if name == "best" else 1.0)
    axes.legend(fontsize=6)
    plt.savefig(folder / "stiffness.png", dpi=120, bbox_inches="tight")
    bh.plotting.picture(front.task.folded(best.design).path[-1], folder / "folded.png")


if __name__ == "__main__":
    population, generations = (*map(int, sys.argv[1:3]), *(24, 5)[len(sys.argv[1:3]) :])
    main(population, generations)
