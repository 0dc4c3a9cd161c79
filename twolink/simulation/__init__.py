"""Simulation of a scene: `simulate` returns a `Trajectory`."""

from twolink.simulation.run import Statistics
from twolink.simulation.simulate import simulate
from twolink.simulation.trajectory import Trajectory

__all__ = ["Statistics", "Trajectory", "simulate"]
