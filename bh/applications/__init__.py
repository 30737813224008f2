"""Studies of the chapters on applications, each a folder or module; they know the solver, it does not know them."""
