"""Settings of all tests: every run draws the same examples, and says from which seed."""

import signal

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

SEED = 20261121

# What a shell starts in the background inherits that Ctrl-C is ignored, and so would all commands
# that the tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(
    "twolink",
    derandomize=True,
    deadline=None,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
# For a long look, with other examples each time: pytest --hypothesis-profile thorough.
settings.register_profile(
    "thorough", settings.get_profile("twolink"), derandomize=False, max_examples=2000
)
# For a night: pytest tests/hardcases/test_fuzz.py --hypothesis-profile nightly.
settings.register_profile(
    "nightly", settings.get_profile("thorough"), max_examples=50_000, database=None
)
settings.load_profile("twolink")


def pytest_report_header() -> str:
    return f"twolink: random states from seed {SEED}; hypothesis draws the same examples each time"


@pytest.fixture
def random() -> np.random.Generator:
    """Random numbers, the same in every run of a test."""
    return np.random.default_rng(SEED)
