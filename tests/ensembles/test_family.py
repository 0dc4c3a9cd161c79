import pickle

import numpy as np
import pytest

from tests.ensembles.cases import UNCOUPLED, axis, ensemble
from twolink.data import data_path
from twolink.errors import SceneError, TwolinkError
from twolink.scene import Scene

URDF = {
    "chain": {"urdf": str(data_path("twolink.urdf"))},
    "start": {"theta": [0.1, 0.2]},
    "run": {"duration": 1.0},
    "effects": {"gravity": {}},
}
EXPLICIT = {**UNCOUPLED, "effects": {"gravity": {}, "joint_damping": {"coefficient": [0.1, 0.2]}}}
SURFACES = {**UNCOUPLED, "effects": {"surface": [{"normal": [0.0, -1.0], "point": [0.0, 9.0]}] * 2}}


@pytest.mark.parametrize(
    ("scene", "parameters"),
    [
        ("free_fall", ["start.q.0", "start.u.1"]),
        ("free_fall", ["chain.mass.1", "chain.length.0", "effects.gravity.g"]),
        (EXPLICIT, ["chain.centre.0.1", "chain.inertia.1", "effects.joint_damping.coefficient.1"]),
        (URDF, ["start.theta.1", "start.omega.0", "effects.gravity.g"]),
    ],
)
def test_the_parts_of_a_run_are_those_of_its_scene(scene, parameters, random):
    family = ensemble(scene=scene, axes=[axis(name, 1.0) for name in parameters]).family
    family = pickle.loads(pickle.dumps(family))
    for _ in range(3):
        values = random.uniform(0.5, 2.0, len(parameters))
        run, parts = family.scene(values), family.parts(values)
        assert (run.moving_chain, run.effects, run.q, run.u) == parts
        assert Scene.parse(run.to_toml()) == run


@pytest.mark.parametrize("scene", ["free_fall", URDF])
def test_starts_side_by_side_are_those_of_each_scene(scene, random):
    names = ("q", "u") if scene == "free_fall" else ("theta", "omega")
    parameters = [f"start.{names[0]}.1", f"start.{names[1]}.0"]
    family = ensemble(scene=scene, axes=[axis(name, 1.0) for name in parameters]).family
    values = random.uniform(-3, 3, (20, 2))
    q, u = family.starts(values)
    runs = [family.scene(row) for row in values]
    assert np.array_equal(q.T, [run.q for run in runs])
    assert np.array_equal(u.T, [run.u for run in runs])


def test_a_parameter_path_with_an_index_changes_that_effect_alone():
    family = ensemble(scene=SURFACES, axes=[axis("effects.surface.1.point.1", 0.0)]).family
    first, second = family.scene([3.0]).effects
    assert (first.point, second.point) == ((0.0, 9.0), (0.0, 3.0))


def test_a_value_that_a_scene_refuses_is_refused_with_the_same_words():
    family = ensemble(axes=[axis("chain.mass.1", 1.0)]).family
    for call in (family.scene, family.parts):
        with pytest.raises(TwolinkError, match="link 2: mass must be a positive number of kg"):
            call([-1.0])


@pytest.mark.parametrize(
    ("parameter", "sentence"),
    [
        (
            "start.q",
            "axes.0.parameter must lead to one number of the chain, the start or an effect",
        ),
        ("start.q.2", "axes.0.parameter: the key in start.q must be one of 0, 1; got '2'"),
        ("start.p.0", "the key in start must be one of q, u; got 'p'"),
        ("run.duration", "the key in the scene must be one of chain, start, effects; got 'run'"),
        ("effects.surface.e", "the key in effects must be one of gravity; got 'surface'"),
        ("start.q.0.0", "must lead to one number"),
        ("speed", "must be one of chain, start, effects, q1, q2, u1, u2, m1"),
    ],
)
def test_parameters_that_are_no_numbers_are_refused(parameter, sentence):
    with pytest.raises(SceneError, match=sentence):
        ensemble(axes=[axis(parameter, 1.0)])
