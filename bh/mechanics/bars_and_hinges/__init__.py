"""The source's formulation: independent bars and hinges."""
