"""The elasto-plastic law: the published formulas again in 40 digits, joins, and work done on it."""

from itertools import pairwise

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from twolink.contact.elastoplastic import ElastoPlastic, Material
from twolink.contact.force_laws import Phase, PlasticState
from twolink.errors import IntegrationError, SimulationError
from twolink.integration.precisions import PRECISIONS

STEEL = Material(modulus=1.15e11, radius=0.01, strength=3e8, poisson=0.3)
SOFT = Material(modulus=1.1e8, radius=0.05, strength=1e6, poisson=0.4)
LAW = ElastoPlastic(STEEL)
DEPTHS = (1.0, 1.5, 1.9001, 3.0, 20.0, 150.0, 1000.0)


def published(material: Material, x: float) -> tuple[mpmath.mpf, mpmath.mpf]:
    """The force (N) at x = δ/δ_y, and the part of that depth that stays, written out again."""
    with mpmath.workdps(40):
        E, R, Sy, nu = map(mpmath.mpf, vars_of(material))
        x = mpmath.mpf(x)
        C = mpmath.mpf("1.295") * mpmath.exp(mpmath.mpf("0.736") * nu)
        delta_y = (mpmath.pi * C * Sy / (2 * E)) ** 2 * R
        P_y = mpmath.mpf(4) / 3 * (R / E) ** 2 * (C * mpmath.pi * Sy / 2) ** 3
        assert abs(P_y / (mpmath.mpf(4) / 3 * E * mpmath.sqrt(R) * delta_y**1.5) - 1) < 1e-30
        if x < 1.9:
            P = P_y * x ** mpmath.mpf(1.5)
        else:
            B = mpmath.mpf("0.14") * mpmath.exp(23 * Sy / E)
            a = R * mpmath.pi * C * Sy / (2 * E) * mpmath.sqrt(x * (x / mpmath.mpf("1.9")) ** B)
            H = Sy * (mpmath.mpf("2.84") - mpmath.mpf("0.92") * (1 - mpmath.cos(mpmath.pi * a / R)))
            P = P_y * (
                mpmath.exp(-(x ** (mpmath.mpf(5) / 12)) / 4) * x**1.5
                + 4 * H / (C * Sy) * (1 - mpmath.exp(-(x ** (mpmath.mpf(5) / 9)) / 25)) * x
            )
        part, offset, scale, power = map(mpmath.mpf, ("1.02", "5.9", "6.9", "-0.54"))
        stays = part * (1 - ((x + offset) / scale) ** power)
        return P, stays


def vars_of(material: Material) -> tuple[float, float, float, float]:
    return material.modulus, material.radius, material.strength, material.poisson


@pytest.mark.parametrize("material", [STEEL, SOFT])
@pytest.mark.parametrize("x", DEPTHS)
def test_forces_and_dents_are_the_published_ones(material, x):
    force, stays = published(material, x)
    depth = x * material.yield_depth
    assert material.compression(depth) == pytest.approx(float(force), rel=1e-13)
    assert material.residual(depth) / depth == pytest.approx(float(stays), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
@pytest.mark.parametrize("x", DEPTHS)
def test_long_numbers_have_the_published_decimals(precision, x):
    """With constants rounded to float64 all runs of a motion shared their rounding."""
    own = PRECISIONS[precision]
    material = Material(*map(own.number, vars_of(SOFT)))
    force, stays = published(SOFT, x)
    depth = own.number(x) * material.yield_depth
    for found, exact in (
        (material.compression(depth), force),
        (material.residual(depth) / depth, stays),
    ):
        with mpmath.workdps(40):
            missed = mpmath.mpf(str(found)) - exact
            assert abs(missed) <= 200 * own.rounding * max(abs(exact), 1)


@pytest.mark.parametrize(("poisson", "jump"), [(0.0, 0.075), (0.3, 0.005), (0.5, -0.034)])
def test_the_published_fits_join_as_well_as_the_docstring_says(poisson, jump):
    material = Material(1.15e11, 0.01, 3e8, poisson)
    hertz = material.stiffness * material.flow_depth**1.5
    assert material.flow_force(material.flow_depth) / hertz - 1 == pytest.approx(jump, abs=5e-4)


@pytest.mark.parametrize(
    ("dent", "ends"),
    [
        (PlasticState(Phase.WHOLE), False),
        (PlasticState(Phase.YIELDS), False),
        (PlasticState(Phase.DENTED, deepest=1.5 * STEEL.yield_depth), False),
        (PlasticState(Phase.DENTED, deepest=3.0 * STEEL.yield_depth), True),
        (PlasticState(Phase.FLOWS), True),
    ],
)
def test_the_force_jumps_where_the_fits_join_and_where_they_end(dent, ends):
    assert LAW.jump(dent) == (STEEL.last_depth if ends else STEEL.flow_depth)


@pytest.mark.parametrize("x", DEPTHS)
def test_restitution_begins_where_compression_ends(x):
    deepest = x * STEEL.yield_depth
    dent = LAW.turned(PlasticState(Phase.FLOWS), deepest)
    branch = LAW.branch(dent)
    spring = deepest - branch.residual
    assert 0 <= branch.residual < deepest
    begins = branch.law.force(spring, spring**0.5, 0.0)
    assert begins == pytest.approx(STEEL.compression(deepest), rel=1e-14)
    # Pressed again, it is the same curve, up to where the point turned.
    again = LAW.branch(LAW.pressed(dent))
    assert again.law == branch.law
    assert again.reach == pytest.approx(spring**0.5, rel=1e-14)
    goes_on = LAW.reached(LAW.pressed(dent))
    assert goes_on.phase is (Phase.YIELDS if x < 1.9 else Phase.FLOWS)


@pytest.mark.parametrize("x", DEPTHS)
@pytest.mark.parametrize("material", [STEEL, SOFT, Material(1e9, 0.1, 1e7, 0.5)])
def test_no_energy_is_gained(material, x):
    """The area below compression, less that below restitution: 0 at the depth of yield."""
    deepest = x * material.yield_depth
    joins = [d for d in (material.flow_depth,) if d < deepest]
    edges = [0.0, *joins, deepest]
    done = sum(
        quad(material.compression, a, b, epsabs=0, epsrel=1e-12)[0] for a, b in pairwise(edges)
    )
    given = 2 / 5 * material.compression(deepest) * (deepest - material.residual(deepest))
    assert given <= done * (1 + 1e-12)
    if x == 1:
        assert given == pytest.approx(done, rel=1e-12)
    if x > 1.9:
        assert given < 0.98 * done


def test_the_law_ends_where_its_dent_is_as_wide_as_the_ball():
    with pytest.raises(SimulationError, match=r"pressed .* m deep, .* the contact radius must be"):
        LAW.turned(PlasticState(Phase.FLOWS), 9000 * STEEL.yield_depth)
    assert LAW.turned(PlasticState(Phase.FLOWS), 4000 * STEEL.yield_depth).residual > 0


def test_the_law_of_a_hard_ball_ends_where_its_dent_is_as_deep_as_the_press():
    hard = Material(1e11, 0.067, 1e8, 0.3)
    deep = 10030 * hard.yield_depth
    assert hard.contact_radius(deep) < 0.5
    with pytest.raises(SimulationError, match=r"a dent must be shallower .* 10018 times the depth"):
        ElastoPlastic(hard).turned(PlasticState(Phase.FLOWS), deep)
    shallower = ElastoPlastic(hard).turned(PlasticState(Phase.FLOWS), 10010 * hard.yield_depth)
    assert shallower.residual < 10010 * hard.yield_depth


@pytest.mark.parametrize("material", [STEEL, SOFT, Material(1e6, 0.1, 2e5, 0.3)])
def test_compression_ends_at_the_last_depth(material):
    law, last = ElastoPlastic(material), material.last_depth
    assert law.branch(PlasticState(Phase.FLOWS)).reach == pytest.approx(last**0.5, rel=1e-15)
    with pytest.raises(IntegrationError, match="to the end of the range of the elasto-plastic law"):
        law.reached(PlasticState(Phase.FLOWS))
    ends = material.contact_radius(last), material.residual(last) / last
    assert max(ends) == pytest.approx(1, rel=1e-12)
    assert law.turned(PlasticState(Phase.FLOWS), last * (1 - 1e-9)).residual < last


def test_a_material_that_yields_too_early_to_flow_is_out_of_range():
    material = Material(1e6, 0.1, 9e5, 0.3)
    assert material.last_depth == material.flow_depth
    with pytest.raises(IntegrationError, match="to the end of the range"):
        ElastoPlastic(material).reached(PlasticState(Phase.YIELDS))
    assert ElastoPlastic(material).reached(PlasticState(Phase.WHOLE)).phase is Phase.YIELDS


def test_a_law_takes_arrays():
    depths = np.array([2.0, 3.0]) * STEEL.yield_depth
    flow = LAW.branch(PlasticState(Phase.FLOWS)).law
    assert flow.force(depths, np.sqrt(depths), 0.0) == pytest.approx(
        [STEEL.flow_force(float(depth)) for depth in depths], rel=1e-15
    )
    assert np.all(flow.stored(depths, np.sqrt(depths)) > 0)
