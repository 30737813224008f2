"""Panels of a sheet that stop each other. Loaded, like the library behind it, only where a model asks for contact."""
