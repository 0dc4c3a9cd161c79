"""Every external engine against this library's reference, and the registry of engines."""

import math
import subprocess
import sys
from dataclasses import replace
from functools import cache

import mpmath
import numpy as np
import pytest

from tests.simulators import simulator_named
from tests.verification.chains import GENERAL
from twolink import lagrange
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.engines.messages import Model, Parameters
from twolink.engines.registry import SIMULATORS
from twolink.errors import EngineError
from twolink.hardcases.state_trial import accelerations
from twolink.loads import motor_loads
from twolink.scene import Scene
from twolink.simulation import simulate

BASE = ("heyoka", "SciPy over Pinocchio")
SECONDS = 1.0
GENERAL_SCENE = replace(Scene.load(data_path("scenes") / "general.toml"), duration=SECONDS)
JOINTS = (Gravity(9.0, (0.6, 0.8)), JointDamping((0.3, 0.2)), JointSpring((4.0, 3.0), (0.2, -0.3)))
TORQUE = JointTorque((0.5, -0.4))
PUSHED = replace(GENERAL_SCENE, effects=(Gravity(), JointSpring((-1.0, 0.0))))
SCENES = {
    "free fall": replace(Scene.load(data_path("scenes") / "free_fall.toml"), duration=SECONDS),
    "general": GENERAL_SCENE,
    "off the axis": replace(GENERAL_SCENE, chain=GENERAL),
    "dampers, springs, torque": replace(GENERAL_SCENE, effects=(*JOINTS, TORQUE)),
    "rotors": replace(
        GENERAL_SCENE,
        effects=(*JOINTS, MotorInertia((0.02, 0.03), (3.0, 5.0), carried=False)),
    ),
    "waves": replace(
        GENERAL_SCENE,
        effects=(*JOINTS, JointTorque((0.1, 0.0), (2.0, 1.5), (3.0, 4.0), (0.3, 0.2))),
    ),
}
# heyoka, as it comes, goes to the end in one step where its order is a multiple of four.
OVERSTEPS = {("heyoka", "taylor", "free fall")}
# Drake solves the steps to a tolerance that does not follow the accuracy asked for.
STALLS = {("Drake", "radau3"), ("Drake", "cenic")}
# No engine has more operations than this on a path from a state to its acceleration.
ROUNDINGS = 256


def marked(name):
    return () if name in BASE else (pytest.mark.engines,)


def each(parameter):
    """Every method with a parameter of a kind."""
    return [
        pytest.param(engine, method, id=f"{engine.name}-{method.name}", marks=marked(engine.name))
        for engine in SIMULATORS
        for method in engine.methods
        if method.parameter == parameter
    ]


ALL = [pytest.param(engine, id=engine.name, marks=marked(engine.name)) for engine in SIMULATORS]


@cache
def reference(name):
    """The state at the end, and by how much an error on the way can grow until then."""
    scene = SCENES[name]

    def end(scene):
        trajectory = simulate(scene, accuracy=1e-14, samples=2)
        assert trajectory.met
        return np.array([*trajectory.q[:, -1], *trajectory.u[:, -1]])

    there, growth, little = end(scene), 1.0, 1e-4
    for index in range(4):
        start = np.array([*scene.q, *scene.u])
        start[index] += little
        moved = replace(scene, q=tuple(start[:2].tolist()), u=tuple(start[2:].tolist()))
        growth = max(growth, float(np.abs(end(moved) - there).max()) / little)
    return there, growth


def error_of(run, name, parameter):
    motion = run(parameter, np.array([0.0, SECONDS]))
    there, _ = reference(name)
    return float(np.abs(np.array([*motion.q[:, -1], *motion.u[:, -1]]) - there).max()), motion


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("engine", "method"), each("step"))
def test_the_order_is_the_declared_one(engine, method, name):
    """Errors against the reference fall by 2^order, as far as rounding lets them be seen."""
    if engine.unsupported(SCENES[name]):
        assert name in ("rotors", "waves")
        return
    run = engine.prepared(SCENES[name], method.name)
    there, growth = reference(name)
    # Each step rounds the state, round-off may grow, and roundings add up as a random walk.
    rounding = 2.0**-53 * float(np.abs(there).max()) * growth
    orders, coarse = [], error_of(run, name, 2.0**-4)[0]
    for power in range(5, 12):
        fine = error_of(run, name, 2.0**-power)[0]
        if fine < 4 * rounding * math.sqrt(2.0**power):
            break
        orders.append(math.log2(coarse / fine))
        coarse = fine
    assert orders[-1] == pytest.approx(method.order, abs=0.2), orders


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("engine", "method"), each("tolerance"))
def test_the_tolerance_is_kept_at_every_step(engine, method, name):
    """Each step adds at most its tolerance, absolute and relative, and this error may grow."""
    scene = SCENES[name]
    assert engine.unsupported(scene) is None
    run = engine.prepared(scene, method.name)
    there, growth = reference(name)
    size = 1 + float(np.abs(there).max()) * growth
    errors, kept = [], []
    for tolerance in (1e-6, 1e-9):
        error, motion = error_of(run, name, tolerance)
        steps = motion.steps or motion.evaluations
        errors.append(error)
        kept.append(error < steps * tolerance * size * growth)
    assert all(kept) == ((engine.name, method.name, name) not in OVERSTEPS), errors
    if all(kept) and (engine.name, method.name) not in STALLS:
        assert errors[1] < errors[0] / 10


@pytest.mark.slow
@pytest.mark.parametrize("name", ["free fall", "general"])
def test_heyoka_is_given_an_odd_order(name):
    """Whatever the tolerance, and at no coarser one than was asked for."""
    run = simulator_named("heyoka").prepared(SCENES[name], "taylor, odd order")
    there, growth = reference(name)
    size = 1 + float(np.abs(there).max()) * growth
    for power in range(3, 17):
        error, motion = error_of(run, name, 10.0**-power)
        assert motion.steps > 10
        assert error < motion.steps * (10.0**-power + 2.0**-52) * size * growth


@pytest.mark.slow
def test_the_comparison_can_fail():
    """A chain that is a millionth heavier is distinguished."""
    scene = replace(GENERAL_SCENE, chain=replace(GENERAL_SCENE.chain, mass=(1.0, 1.000001)))
    run = simulator_named("heyoka").prepared(scene, "taylor")
    assert error_of(run, "general", 1e-15)[0] > 1e3 * 1e-12


@pytest.mark.parametrize("engine", ALL)
def test_samples_are_at_the_requested_times(engine):
    """Uneven times, each as when it is the last: up to the method's error."""
    times = np.array([0.0, 0.013, 0.4, 0.41, 0.7])
    method = engine.methods[0]
    run = engine.prepared(GENERAL_SCENE, method.name)
    parameter = 1e-3 if method.parameter == "step" else 1e-9
    motion = run(parameter, times)
    assert motion.q.shape == motion.u.shape == (2, len(times))
    assert motion.q[:, 0] == pytest.approx(GENERAL_SCENE.q, abs=1e-15)
    assert motion.u[:, 0] == pytest.approx(GENERAL_SCENE.u, abs=1e-15)
    trajectory = simulate(replace(GENERAL_SCENE, duration=0.7), accuracy=1e-12)
    q, u = trajectory.at(times)
    # A first-order method with steps of a millisecond is off by as many milliradians or so.
    allowed = 0.05 if method.order == 1 else 1e-5
    assert motion.q == pytest.approx(q, abs=allowed)
    assert motion.u == pytest.approx(u, abs=allowed)
    assert motion.seconds > 0
    assert motion.setup_seconds > 0
    again = run(parameter, times)
    assert np.array_equal(motion.q, again.q), "a second run begins where the first began"
    assert (motion.steps or motion.evaluations) == (again.steps or again.evaluations)


@pytest.mark.parametrize("engine", SIMULATORS, ids=lambda engine: engine.name)
def test_a_spring_that_pushes_is_refused_by_drake_alone(engine):
    sentence = "Drake cannot express negative stiffness: it rejects negative stiffness"
    assert engine.unsupported(PUSHED) == (sentence if engine.name == "Drake" else None)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ALL)
def test_a_spring_that_pushes_is_simulated(engine):
    if engine.unsupported(PUSHED):
        assert engine.name == "Drake"
        return
    method = engine.methods[0]
    run = engine.prepared(PUSHED, method.name)
    motion = run(1e-3 if method.parameter == "step" else 1e-9, np.array([0.0, SECONDS]))
    trajectory = simulate(PUSHED, accuracy=1e-12, samples=2)
    allowed = 0.05 if method.order == 1 else 1e-5
    assert motion.q == pytest.approx(trajectory.q, abs=allowed)


@pytest.mark.engines
def test_an_assertion_that_fails_in_drake_is_an_error_of_the_engine(monkeypatch):
    """pydrake raises `SystemExit` there, which would end the program."""
    drake = simulator_named("Drake")
    monkeypatch.setattr(type(drake), "expresses", drake.expresses | {"push"})
    with pytest.raises(EngineError, match=r"^Drake rejects the chain: .*stiffness >= 0"):
        drake.prepared(PUSHED, "runge_kutta3")


@pytest.mark.slow
@pytest.mark.parametrize("engine", ALL)
def test_accelerations_agree_with_fifty_digits(engine, random):
    """Against 50 digits, within the round-off of M⁻¹ times the forces."""
    for _ in range(20):
        q, u = random.uniform(-3, 3, 2).tolist(), random.uniform(-5, 5, 2).tolist()
        g, torque = random.uniform(-10, 10), random.uniform(-4, 4, 2).tolist()
        found = accelerations(engine, GENERAL, q, u, g, torque)
        with mpmath.workdps(50):
            exact = GENERAL.convert(mpmath.mpf)
            state = [[mpmath.mpf(x) for x in pair] for pair in (q, u)]
            loads = (*Gravity(mpmath.mpf(g)).loads(exact, *state), *motor_loads(*torque))
            du = lagrange.forward_dynamics(exact, *state, loads)
            M = np.array(lagrange.mass_matrix(exact, state[0]), dtype=float)
        forces = sum(
            np.abs(np.array(part, dtype=float)).max()
            for part in (
                lagrange.velocity_terms(GENERAL, q, u),
                np.abs(M) @ np.array(du, dtype=float),
                [9.81 * GENERAL.m1, 10 * GENERAL.m2 * (GENERAL.L1 + GENERAL.L2)],
                torque,
            )
        )
        bound = ROUNDINGS * 2.0**-53 * np.linalg.cond(M) * np.linalg.norm(np.linalg.inv(M))
        assert found == pytest.approx([float(x) for x in du], abs=bound * forces)


@pytest.mark.parametrize("scene", ["painleve", "stick_slip", "joint_stops", "drop", "hertz_bounce"])
@pytest.mark.parametrize("engine", SIMULATORS, ids=lambda engine: engine.name)
def test_unsupported_effects_are_rejected_with_one_sentence(engine, scene):
    scene = Scene.load(data_path("scenes") / f"{scene}.toml")
    sentence = engine.unsupported(scene)
    assert sentence.startswith(f"{engine.name} cannot express ")
    assert "\n" not in sentence
    if engine.missing() is None:
        with pytest.raises(EngineError, match="cannot express"):
            engine.prepared(scene, engine.methods[0].name)


@pytest.mark.parametrize("engine", ALL)
def test_method_names_are_checked(engine):
    assert engine.missing() is None
    assert engine.version[0].isdigit()
    with pytest.raises(EngineError, match=r"method must be one of .*; got 'by magic'"):
        engine.prepared(GENERAL_SCENE, "by magic")


def test_names():
    assert simulator_named("mujoco").name == "MuJoCo"
    with pytest.raises(EngineError, match="engine must be one of heyoka, SciPy over Pinocchio"):
        simulator_named("Bullet Time")
    assert len({engine.name for engine in SIMULATORS}) == len(SIMULATORS)


@pytest.mark.slow
def test_the_registry_imports_no_engine():
    program = (
        "import sys\n"
        "from twolink.engines.registry import SIMULATORS\n"
        "[(engine.missing(), engine.methods) for engine in SIMULATORS]\n"
        "print(*{m.split('.')[0] for m in sys.modules})"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    engines = {"pinocchio", "mujoco", "pydrake", "jax", "diffrax", "pybullet", "sympy", "heyoka"}
    assert not engines & set(run.stdout.split())


@pytest.mark.engines
def test_sympy_stays_out_of_this_process():
    program = (
        "import sys\n"
        "from twolink.engines.sympy_code import SympyCode\n"
        "from twolink.chain import Chain\n"
        "from twolink.hardcases.state_trial import accelerations\n"
        "if __name__ == '__main__':\n"
        "    bars, rest = Chain.uniform_bars(), (0.0, 0.0)\n"
        "    accelerations(SympyCode(), bars, rest, rest, 9.81, rest)\n"
        "    print('sympy' in sys.modules)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == ["False"]


@pytest.mark.engines
def test_mujocos_messages_are_kept_and_not_written_to_a_file(tmp_path, monkeypatch):
    """A second link of 1e9 m: its inertia matrix is close to singular, and it says so."""
    monkeypatch.chdir(tmp_path)
    mujoco, long = simulator_named("MuJoCo"), Chain.uniform_bars(length=(1.0, 1e9))
    scene = replace(GENERAL_SCENE, chain=long)
    motion = mujoco.prepared(scene, "Euler")(1e-3, np.array([0.0, 0.01]))
    assert any(sentence.startswith("mjWARN_INERTIA") for sentence in motion.warnings)
    assert any("close to singular" in sentence for sentence in motion.warnings)
    with pytest.warns(UserWarning, match="close to singular"):
        accelerations(mujoco, long, (0.3, -1.2), (2.0, -3.0), 9.81, (0.0, 0.0))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.engines
def test_diffrax_compiles_accelerations_once_for_all_states(monkeypatch):
    import jax

    compile, compiled = jax.jit, []
    monkeypatch.setattr(jax, "jit", lambda function: compiled.append(function) or compile(function))
    engine, states = simulator_named("diffrax"), np.arange(6.0).reshape(3, 2)
    parameters = {"mass": (1.25, 0.75), "length": (1.0, 1.0), "centre": ((0.5, 0.0), (0.5, 0.0))}
    chain = Parameters(**parameters, inertia=(0.1, 0.2), gravity=9.5)
    for _ in range(2):
        engine.load(Model(id="chain", parameters=chain))
        engine.forward_dynamics(states, states, states)
    assert len(compiled) == 1
