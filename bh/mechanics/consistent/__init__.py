"""The consistent formulation: coupled bars and coupled hinges, which converge to Kirchhoff-Love theory."""
