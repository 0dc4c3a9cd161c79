import numpy as np
import pytest

from tests.ensembles.evaluated import evaluated, symbolic
from twolink.chain import Chain
from twolink.effects import (
    EndDrag,
    Gravity,
    JointDamping,
    JointSpring,
    JointTorque,
    MotorInertia,
    PdControl,
    with_rotors,
)
from twolink.ensembles.motion_terms import motion_terms
from twolink.optional import heyoka
from twolink.simulation.smooth.equations import EQUATIONS

CHAIN = Chain((1.3, 0.7), (0.9, 1.1), ((0.4, 0.1), (0.6, -0.2)), (0.05, 0.08))
EFFECTS = {
    "none": (),
    "gravity": (Gravity(),),
    "all": (
        Gravity(),
        JointDamping((0.3, 0.2)),
        JointSpring((2.0, 3.0), (0.1, -0.4)),
        EndDrag(0.3),
        PdControl((1.0, 2.0), (0.5, 0.1), (0.3, -0.2)),
        JointTorque((0.2, -0.1), (1.5, 0.7), (2.0, 3.0), (0.4, 0.0)),
    ),
    "rotors": (Gravity(), MotorInertia((0.02, 0.03), (5.0, -3.0))),
}
ORDER = 12
START = np.array([0.4, -1.1, 0.8, -0.3])
TIME = 0.7


@pytest.mark.parametrize("name", EFFECTS)
def test_the_terms_are_those_of_heyoka(name):
    effects = EFFECTS[name]
    chain = with_rotors(effects, CHAIN)
    hy = heyoka()
    names = hy.make_vars("q1", "q2", "p1", "p2")
    found = motion_terms(chain, effects, tuple(names[:2]), tuple(names[2:]), hy.time)
    series = (*found.q, *found.p, *found.u, *found.forces)
    flat = [term for each in series for term in each.terms(ORDER)]
    values = hy.cfunc(flat, names)(START, time=TIME).reshape(8, ORDER)
    first, second = EQUATIONS["momenta"].rates(chain, effects, names[:2], names[2:], hy.time)
    integrator = hy.taylor_adaptive(
        list(zip(names, (*first, *second), strict=True)), START, time=TIME, tol=1e-12
    )
    integrator.step(write_tc=True)
    expected = integrator.tc[:, :ORDER]
    sizes = np.abs(expected).max(axis=0)
    assert (np.abs(values[:4] - expected) < 1e-12 * sizes).all()
    # The series of u and of dp/dt are the derivatives of the others.
    slopes = values[:4, 1:] * np.arange(1, ORDER)
    assert np.abs(values[4:, :-1] - slopes).max() < 1e-12 * np.abs(slopes).max()


def test_the_mass_matrix_and_its_slope():
    hy = heyoka()
    names = hy.make_vars("q1", "q2", "p1", "p2")
    found = motion_terms(CHAIN, (), tuple(names[:2]), tuple(names[2:]), hy.time)
    flat = [
        *found.mass.entries,
        *found.mass.inverse,
        found.across,
        *found.mass.sizes_of_momenta(symbolic([2.0, -3.0])),
        *found.mass.speeds((names[2], names[3])),
    ]
    M11, M12, M22, A11, A12, A22, across, size1, size2, u1, u2 = evaluated(flat, names, START)
    assert [[M11, M12], [M12, M22]] @ np.array([[A11, A12], [A12, A22]]) == pytest.approx(np.eye(2))
    expected = EQUATIONS["momenta"].to_speeds(CHAIN, START[:2], START[2:])
    assert (u1, u2) == pytest.approx(expected)
    sizes = np.abs([[M11, M12], [M12, M22]]) @ [2.0, 3.0]
    assert (size1, size2) == pytest.approx(sizes)
    step = 1e-6
    places = [START + np.array([0.0, sign * step, 0.0, 0.0]) for sign in (1, -1)]
    moved = [evaluated([found.mass.entries[1]], names, place)[0] for place in places]
    assert -across == pytest.approx((moved[0] - moved[1]) / (2 * step), rel=1e-8)


def test_nine_products_of_series():
    hy = heyoka()
    names = hy.make_vars("q1", "q2", "p1", "p2")
    bars = Chain.uniform_bars((1.0, 1.0), (1.0, 1.0))
    found = motion_terms(bars, (Gravity(),), tuple(names[:2]), tuple(names[2:]), hy.time)
    counts = []
    for order in (10, 11):
        function = hy.cfunc([x.term(order) for x in (*found.q, *found.p)], names)
        counts.append(sum("*" in str(each) for each in function.dc))
    # Eleven multiplications for the next term of each product, and less than one by numbers.
    assert 9 * 11 <= counts[1] - counts[0] < 10 * 11
