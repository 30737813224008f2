"""The readings of `readings.csv`: nobody measured, the shell did with L* = 20 mm, on a mesh of its own, with noise."""

from pathlib import Path

import numpy as np

import bh

SIGMA = 0.010  # N
scene = Path("lifted-by-the-shell.toml")
text = (Path(__file__).parent / "lifted.toml").read_text(encoding="utf-8")
text = text.replace("50mm", "20mm").replace("along = 24\nrows = 4", "along = 16\nrows = 2")
scene.write_text(text + '\n[model]\nformulation = "shell"\n', encoding="utf-8")
path = bh.trace(bh.load_scene(scene).model, estimate=False).require()
ends = {state.step: state for state in path}
force = np.array([ends[step].reaction("crease:crease")[2] for step in sorted(ends)])
read = force + SIGMA * np.random.default_rng(1).normal(size=len(force))
rows = [f"{lift},{1000.0 * value:.1f}" for lift, value in zip((0.8, 1.6, 2.4), read, strict=True)]
Path("readings.csv").write_text("\n".join(("lift,force", *rows)) + "\n", encoding="utf-8")
print("\n".join(rows))
