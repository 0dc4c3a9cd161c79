"""Plots of a trajectory and of a verdict, one kind a file, all in one style."""
