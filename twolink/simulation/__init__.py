"""From a scene to a trajectory."""

from twolink.simulation.simulate import simulate
from twolink.simulation.trajectory import Statistics, Trajectory

__all__ = ["Statistics", "Trajectory", "simulate"]
