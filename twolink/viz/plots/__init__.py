"""Plots of a trajectory and of a verdict, one kind per file, in a common style."""
