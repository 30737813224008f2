"""Chapter 4: corrugations."""
