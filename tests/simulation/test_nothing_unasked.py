"""Effects that a scene does not name are absent: in compiled code and in modules."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from twolink.data import data_path
from twolink.effects import ContactEffect
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_drag import EndDrag
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.effects.pd_control import PdControl
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.effects_cost import effects_cost
from twolink.simulation.motion import motion_run
from twolink.simulation.smooth.taylor import taylor_run

FALL = Scene.load(data_path("scenes") / "free_fall.toml")

EFFECTS = (
    EndForce(-3.0, 0.4, sliding=1),
    EndForce(-3.0, 0.4),
    JointTorque((1.5, -0.7)),
    JointTorque((0.1, 0.2), (1.5, -0.7), (3.0, 5.0)),
    SampledTorque((0.0, 0.2), (1.0, 2.0), (0.0, 0.0), "linear"),
    JointDamping((0.3, 0.7)),
    JointFriction((0.1, 0.1)),
    JointSpring((4.0, 3.0)),
    JointStop("A", upper=3.0),
    Surface((0.0, 1.5), (0.0, -1.0), friction=0.3, restitution=0.5),
    CompliantSurface((0.0, 1.5), (0.0, -1.0), "hertz", 1e5),
    CompliantSurface((0.0, 1.5), (0.0, -1.0), "kelvin-voigt", 1e5, 10.0),
    CompliantSurface(
        (0.0, 1.5), (0.0, -1.0), "elasto-plastic", radius=0.02, modulus=(2.1e11, 7e10),
        poisson=(0.3, 0.33), strength=(1e9, 1e8),
    ),
    PdControl((0.4, 0.8), (20.0, 10.0), (2.0, 1.0)),
    MotorInertia((0.1, 0.1), (2.0, 2.0)),
    EndDrag(0.6),
)  # fmt: skip


def by_hand(gravity: bool) -> int:
    """The operations of the derivation's bars in (q, p), written by hand with all constants formed.

    M = [[4/3, c/2], [c/2, 1/3]] with c and s of q2 − q1, so det M = 7/36 + (s/2)², and
    ∂T/∂q2 = −(s/2) u1 u2; the weights turn by 14.715 cos q1 and 4.905 cos q2.
    """
    hy = heyoka()
    q1, q2, p1, p2 = hy.make_vars("q1", "q2", "p1", "p2")
    delta = q2 - q1
    half_cosine, half_sine = 0.5 * hy.cos(delta), 0.5 * hy.sin(delta)
    det = 7 / 36 + half_sine * half_sine
    u1 = (1 / 3 * p1 - half_cosine * p2) / det
    u2 = (4 / 3 * p2 - half_cosine * p1) / det
    slope = half_sine * (u1 * u2)
    rates = (slope, -1.0 * slope)
    if gravity:
        rates = (14.715 * hy.cos(q1) + slope, 4.905 * hy.cos(q2) - slope)
    system = list(zip((q1, q2, p1, p2), (u1, u2, *rates), strict=True))
    return len(hy.taylor_adaptive(system, [0.0] * 4, opt_level=0).decomposition) - 8


def operations(*effects) -> int:
    scene = replace(FALL, effects=effects, duration=0.1)
    return motion_run(scene, (0.0, 0.1), formulation="momenta").operations


def test_the_compiled_code_has_as_many_operations_as_code_by_hand():
    assert operations(Gravity()) == by_hand(gravity=True) == 25
    assert operations() == by_hand(gravity=False)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: type(effect).__name__)
def test_an_absent_effect_adds_no_operations(effect):
    """With it there is more to do; without it, again exactly the operations written by hand."""
    with_it = replace(FALL, effects=(Gravity(), effect), duration=0.1)
    assert motion_run(with_it, (0.0, 0.1), formulation="momenta").operations > 25
    left_out = replace(with_it, effects=with_it.effects[:1])
    assert motion_run(left_out, (0.0, 0.1), formulation="momenta").operations == 25
    if not isinstance(effect, ContactEffect) or not effect.contact_elements(FALL.chain):
        cost = effects_cost(with_it)
        assert cost.without[type(effect).__name__].operations == 25


def test_a_smooth_scene_has_no_events():
    run = taylor_run(FALL, (0.0, 1.0), formulation="momenta")
    assert run.events == run.log == ()


@pytest.mark.slow
def test_only_the_modules_of_the_scene_s_effects_are_imported():
    """No module of modes, impacts or events for a smooth scene; each effect's own module alone."""
    program = (
        "import sys\n"
        "from twolink.scene import Scene\n"
        "from twolink.simulation import simulate\n"
        "simulate(Scene.load(sys.argv[1]))\n"
        "print(*[m for m in sys.modules if m.startswith('twolink.')])"
    )

    def loaded(name: str) -> set[str]:
        file = data_path("scenes") / name
        run = subprocess.run(
            [sys.executable, "-c", program, str(file)],
            capture_output=True, text=True, check=True, cwd=Path(__file__).parent,
        )  # fmt: skip
        return set(run.stdout.split())

    smooth, stops = loaded("free_fall.toml"), loaded("joint_stops.toml")
    solver = {f"twolink.simulation.hybrid.{name}" for name in ("flow", "jump", "run")}
    assert not {m for m in smooth if m.startswith("twolink.simulation.hybrid.")}
    assert solver <= stops
    assert {m for m in smooth if m.startswith("twolink.effects.")} == {
        "twolink.effects.effect",
        "twolink.effects.gravity",
    }
    assert {m for m in stops if m.startswith("twolink.effects.")} == {
        "twolink.effects.effect",
        "twolink.effects.gravity",
        "twolink.effects.joint_stop",
    }
