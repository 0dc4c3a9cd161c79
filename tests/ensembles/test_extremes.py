import numpy as np
import pytest

from tests.ensembles.cases import starts, torques
from twolink.ensembles.chunk import rows_of
from twolink.simulation import simulate

KEEP = {"extremes": True}


def test_the_top_of_a_parabola_is_found():
    # q2 = 2 t − α t²/2 with its top 2/α at 2/α s, between steps.
    rows = rows_of(torques(-0.35, -0.6, keep=KEEP, u2=2.0), 0, 2).arrays
    alpha = np.array([0.7, 1.2])
    # To one part in 10¹³, and the round-off of a few steps.
    assert (np.abs(rows["largest"][:, 1] - 2 / alpha) < 2e-13 * (1 + 2 / alpha)).all()
    ends = 8 - alpha * 8
    assert np.abs(rows["smallest"][:, 1] - np.minimum(0, ends)).max() < 1e-12


@pytest.mark.slow
def test_no_sample_of_a_fine_simulation_is_outside_and_one_is_near():
    asked = starts(3, keep=KEEP, runs={"accuracy": 1e-8, "duration": 3.0})
    rows = rows_of(asked, 0, 9).arrays
    for run in (1, 5):
        scene = asked.family.scene(asked.values(run, run + 1)[0])
        truth = simulate(scene, samples=30_001)
        angles = np.array([*truth.q, truth.q[1] - truth.q[0]])
        slack = 2 * (rows["error"][run] + truth.error)
        for found, sampled in (
            (rows["largest"][run], angles.max(axis=1)),
            (-rows["smallest"][run], -angles.min(axis=1)),
        ):
            assert (sampled <= found + slack).all()
            # A tenth of a millisecond beside its top, at some 100 rad/s².
            assert (found <= sampled + 1e-6 + slack).all()
