"""Following the equilibrium of a model through its steps, on its own mesh or to a wanted accuracy."""
