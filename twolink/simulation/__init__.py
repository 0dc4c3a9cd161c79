"""Simulation of a scene: `simulate` returns a `Trajectory`."""

from twolink.simulation.options import RunOptions
from twolink.simulation.run import Statistics
from twolink.simulation.simulate import simulate, simulate_with
from twolink.simulation.trajectory import Trajectory

__all__ = ["RunOptions", "Statistics", "Trajectory", "simulate", "simulate_with"]
