"""The derivation page: every equation that the code cites is on it, and the code agrees with it."""

import re
from pathlib import Path

import pytest
import sympy as sp

from tests.symbols import CHAIN, DU, LOADS, Q, U, vanishes
from twolink import kane, lagrange

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "derivation.md").read_text(encoding="utf-8")
SLIPS = (ROOT / "tests" / "test_slips.py").read_text(encoding="utf-8")
TAGS = re.findall(r"\\tag\{(6\.\d+[a-z]?)\}", PAGE)
MODULES = sorted((ROOT / "twolink").rglob("*.py"))


def cited(text):
    """Return the equations and sections of the derivation that a text names."""
    return re.findall(r"\((6\.\d+[a-z]?)\)", text), re.findall(r"[Ss]ection (6\.\d+)", text)


def test_every_equation_number_is_unique():
    assert len(TAGS) == len(set(TAGS))
    assert [tag for tag in TAGS if tag[-1].isdigit()] == [f"6.{n}" for n in range(1, 10)]


def test_equations_cited_by_the_code_are_on_the_page():
    for path in MODULES:
        equations, sections = cited(path.read_text(encoding="utf-8"))
        assert set(equations) <= set(TAGS), path
        assert all(f"\n## {section} " in PAGE for section in sections), path


def test_the_code_cites_equations_and_sections():
    equations, sections = cited("\n".join(path.read_text(encoding="utf-8") for path in MODULES))
    assert {"6.2", "6.3", "6.4", "6.7", "6.8", "6.9"} <= set(equations)
    assert {"6.1", "6.2"} == set(sections)


def test_the_page_cites_its_own_numbers_alone():
    assert set(cited(PAGE)[0]) <= set(TAGS)


def test_every_slip_has_its_test():
    slips = re.findall(r"^(\d)\. ", PAGE.partition("## Slips of the textbook")[2], re.MULTILINE)
    assert slips == [str(n) for n in range(1, 8)]
    assert all(f"def test_{n}_" in SLIPS for n in slips)


def printed():
    """Return M and C u as (6.7a) to (6.7c) print them, and det M as (6.8a)."""
    (a1, b1), (a2, b2) = CHAIN.centre
    delta, factor = Q[1] - Q[0], CHAIN.m2 * CHAIN.L1
    I1 = CHAIN.I_C1 + CHAIN.m1 * (a1**2 + b1**2)
    I2 = CHAIN.I_C2 + CHAIN.m2 * (a2**2 + b2**2)
    M12 = factor * (a2 * sp.cos(delta) - b2 * sp.sin(delta))
    slope = a2 * sp.sin(delta) + b2 * sp.cos(delta)
    det = I1 * I2 + factor * CHAIN.L1 * (CHAIN.I_C2 + CHAIN.m2 * slope**2)
    M = ((I1 + factor * CHAIN.L1, M12), (M12, I2))
    return M, (-factor * slope * U[1] ** 2, factor * slope * U[0] ** 2), det


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_the_results_are_those_of_the_code(formulation):
    M, Cu, det = printed()
    for r in (0, 1):
        assert vanishes(formulation.velocity_terms(CHAIN, Q, U)[r] - Cu[r])
        for s in (0, 1):
            assert vanishes(formulation.mass_matrix(CHAIN, Q)[r][s] - M[r][s])
    assert vanishes(formulation.determinant(CHAIN, Q) - det)


def test_the_left_hand_side_of_6_9_is_the_inertia_force_of_6_8():
    K_in = kane.generalized_inertia_force(CHAIN, Q, U, DU)
    rates = lagrange.momentum_rates(CHAIN, Q, U, DU)
    slopes = lagrange.energy_gradient(CHAIN, Q, U)
    by_kane = kane.generalized_active_force(CHAIN, Q, LOADS)
    by_lagrange = lagrange.generalized_active_force(CHAIN, Q, LOADS)
    for r in (0, 1):
        assert vanishes(rates[r] - slopes[r] + K_in[r])
        assert vanishes(by_kane[r] - by_lagrange[r])
