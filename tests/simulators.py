"""Simulators by name."""

from twolink.engines.registry import SIMULATORS, by_name
from twolink.engines.simulation_engine import SimulationEngine


def simulator_named(name: str) -> SimulationEngine:
    """Return an engine that simulates scenes, as `by_name` does."""
    return by_name(name, {engine.name: engine for engine in SIMULATORS})
