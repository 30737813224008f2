"""Chapter 6: inverse design."""
