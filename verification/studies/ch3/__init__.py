"""Chapter 3: bars and hinges."""
