"""Checks of `bh` and `fem` against closed forms, published numbers and each other."""
