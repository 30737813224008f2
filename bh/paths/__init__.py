"""Equilibrium paths: their states, files, provenance and exports."""
