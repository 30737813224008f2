"""Formulations, solver and hard cases."""
