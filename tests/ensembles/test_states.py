import numpy as np

from tests.ensembles.cases import starts, torques
from twolink.ensembles.chunk import rows_of
from twolink.simulation import simulate

KEEP = {"final": True, "energy": True, "samples": 41}


def test_states_energies_and_samples_are_those_of_a_simulation():
    asked = starts(3, keep=KEEP)
    rows = rows_of(asked, 0, 9).arrays
    for run in (0, 4, 7):
        scene = asked.family.scene(asked.values(run, run + 1)[0])
        truth = simulate(scene, accuracy=1e-11, samples=41)
        error = rows["error"][run] + truth.error
        assert np.abs(rows["q"][run] - truth.q[:, -1]).max() <= error
        assert np.abs(rows["u"][run] - truth.u[:, -1]).max() <= error
        assert np.abs(rows["q_samples"][run] - truth.q.T).max() <= error
        assert abs(rows["energy_start"][run] - truth.energy[0]) < 1e-12
        assert abs(rows["energy_end"][run] - truth.energy[-1]) < 1e-4


def test_a_motion_in_closed_form_is_sampled_at_its_times():
    rows = rows_of(torques(0.5, -1.0, keep={"samples": 5}), 0, 2).arrays
    t = np.linspace(0, 4, 5)
    assert np.abs(rows["q_samples"][:, :, 1] - [t**2 / 2, -(t**2)]).max() < 1e-12
