"""The chapters of the source that the cases belong to, and the pages of the report; a case says where it belongs in
`verification.framework.cases`.
"""

from __future__ import annotations

from dataclasses import dataclass

from verification.framework.cases import BY_NAME


@dataclass(frozen=True)
class Chapter:
    """A page of the report: its key, what the source calls it, what is asked there."""

    key: str
    title: str
    question: str

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
    ),
    Chapter(
        "4",
        "Corrugations",
        "How stiff are curved-crease corrugations in bending, in every direction?",
    ),
    Chapter(
        "5",
        "Pinching",
        "Which shapes does a pinch give a creased sheet, and what do they resist?",
    ),
    Chapter(
        "6",
        "Inverse design",
        "Which crease pattern folds to a wanted shape?",
    ),
    Chapter(
        "A",
        "Isometric theory",
        "Do crease, rulings and fold angle obey the differential geometry of developable sheets?",
    ),
    Chapter(
        "B",
        "Shell finite elements",
        "What does an independent shell model give for the creased annulus sector, and how near are the others?",
    ),
    Chapter(
        "solver",
        "Formulations, solver and hard cases",
        "Do the formulations converge, is the shell to be trusted as a judge, and what can stop the solver?",
    ),
)  # fmt: skip
OTHER = Chapter("other", "Further cases", "What else has been checked?")


def chapter_of(case: str) -> Chapter:
    """The chapter that a case belongs to; `OTHER` for cases that are not listed any more."""
    key = BY_NAME[case].chapter if case in BY_NAME else OTHER.key
    return next((chapter for chapter in CHAPTERS if chapter.key == key), OTHER)
