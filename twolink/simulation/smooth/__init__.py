"""Integrators of motion without events: Taylor series, SciPy's methods, and fixed steps."""
