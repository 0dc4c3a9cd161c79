"""Fixtures of several modules: a run and its judge, which no test changes."""

import pytest

from tests.simulation.hybrid import BOUNCE_TIMES, BOUNCES
from twolink.simulation.hybrid.run import hybrid_run


@pytest.fixture(scope="module")
def run():
    """A run of a chain that bounces on a stop."""
    return hybrid_run(BOUNCES, BOUNCE_TIMES)


@pytest.fixture(scope="module")
def judge():
    """The run that judges it."""
    return hybrid_run(BOUNCES, BOUNCE_TIMES, formulation="kane", precision="long double")
