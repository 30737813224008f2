"""Chapter 5: pinching."""
