"""Closed forms, one file a source; nothing in here imports the solvers."""
