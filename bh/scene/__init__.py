"""Scenes: a model in TOML, read with one clear line for what is wrong in it."""
