"""Trajectories shared by several tests, each simulated once."""

import pytest

from twolink.data import data_path
from twolink.scene import Scene
from twolink.simulation import simulate


@pytest.fixture(scope="session")
def run():
    """Return a function that gives a shipped scene's trajectory."""
    known = {}

    def of(name):
        if name not in known:
            scene = Scene.load(data_path(f"scenes/{name}.toml"))
            known[name] = simulate(scene, accuracy=1e-9, samples=301)
        return known[name]

    return of
