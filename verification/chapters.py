"""The chapters of the source that the cases belong to, and the pages of the report. Data, and no more.

A case shows up on the page of the first chapter that lists it, by its name or by a pattern such as `fig5_*`; adding one
to the report is adding it here (a test asks for it).
"""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase


@dataclass(frozen=True)
class Chapter:
    """A page of the report: its key, what the source calls it, what is asked there, and the cases that answer."""

    key: str
    title: str
    question: str
    cases: tuple[str, ...]

    @property
    def name(self) -> str:
        """ "Chapter 3", "Appendix B", "Solver"."""
        if self.key.isdigit():
            return f"Chapter {self.key}"
        return f"Appendix {self.key}" if len(self.key) == 1 else self.key.capitalize()

    @property
    def page(self) -> str:
        """The name of its page without the ending."""
        return self.name.lower().replace(" ", "-")


CHAPTERS = (
    Chapter(
        "3",
        "Bars and hinges",
        "Does the bar-and-hinge model reproduce the strips, cones, creases, stiffnesses and fans of the source?",
        ("strips", "shear_calibration", "cone", "fig3_*", "scan", "sheets_3*"),
    ),
    Chapter(
        "4",
        "Corrugations",
        "How stiff are curved-crease corrugations in bending, in every direction?",
        ("fig4_*", "tables4*", "top_down*", "bottom_up*", "three_point*", "corrugation*"),
    ),
    Chapter(
        "5",
        "Pinching",
        "Which shapes does a pinch give a creased sheet, and what do they resist?",
        ("fig5_*", "pinch*", "table5*"),
    ),
    Chapter(
        "6",
        "Inverse design",
        "Which crease pattern folds to a wanted shape?",
        ("fig6_*", "forward*", "problem_*", "inverse*", "table6*"),
    ),
    Chapter(
        "A",
        "Isometric theory",
        "Do crease, rulings and fold angle obey the differential geometry of developable sheets?",
        ("appendix_a*", "isometric*"),
    ),
    Chapter(
        "B",
        "Shell finite elements",
        "What does an independent shell model give for the creased annulus sector, and how near are the others?",
        ("appendix_b*",),
    ),
    Chapter(
        "solver",
        "Formulations, solver and hard cases",
        "Do the formulations converge, is the shell to be trusted as a judge, and what can stop the solver?",
        (
            "speed_error*", "honesty*", "consistent", "convergence", "derivatives", "shell_benchmarks", "hard_cases",
            "campaign",
            "crossing*", "crease_network*", "patterns*", "sweep*", "symmetry*", "accuracy*", "import*",
        ),
    ),
)  # fmt: skip
OTHER = Chapter("other", "Further cases", "What else has been checked?", ("*",))


def chapter_of(case: str) -> Chapter:
    """The chapter that a case belongs to; `OTHER` if none lists it."""
    for chapter in CHAPTERS:
        if any(fnmatchcase(case, pattern) for pattern in chapter.cases):
            return chapter
    return OTHER
