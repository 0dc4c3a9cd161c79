from dataclasses import replace

import numpy as np
import pytest
import sympy

from tests.variations.cases import SPRING, STIFFNESS, J, oscillation
from twolink.errors import ParameterError
from twolink.scene import Scene
from twolink.variations.sensitivity import sensitivity
from twolink.variations.uncertainty import LINEAR, factor_of

NAMES = ("start.q.0", "start.u.0")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return the derivatives of an oscillator, which is linear in its start."""
    return sensitivity(SPRING, (*NAMES, "chain.mass.1"), samples=41)


def test_the_covariance_of_an_oscillator_is_that_of_its_closed_form(found):
    _, _, (q_by_q, u_by_q), (q_by_u, u_by_u) = oscillation(found.t)
    C = np.array([[4e-6, 1e-6], [1e-6, 9e-6]])
    got = found.uncertainty(covariance=np.pad(C, (0, 1)))
    S = np.array([[q_by_q, q_by_u], [u_by_q, u_by_u]])
    expected = np.einsum("ikn,kl,jln->nij", S, C, S)
    assert got.covariance[:, ::2, ::2] == pytest.approx(expected, abs=1e-17)
    assert np.abs(got.covariance[:, 1::2, :]).max() < 1e-18
    assert got.deviation[0] == pytest.approx(np.sqrt(expected[:, 0, 0]))


def test_the_first_order_of_a_linear_motion_holds_to_its_end(found):
    got = found.uncertainty({"start.q.0": 0.1, "start.u.0": 0.2})
    assert got.departure.max() < 1e-12
    assert got.linear_until == found.t[-1]
    assert "differ from the first order by" in got.note


def test_the_departure_of_a_wide_spread_is_that_of_the_closed_form(found):
    sigma = 0.1
    got = found.uncertainty({"chain.mass.1": sigma})
    own, by_w, _, _ = oscillation(found.t)
    first_order = np.array(by_w) * -np.sqrt(STIFFNESS / J) / (2 * J) * sigma
    off = np.zeros(len(found.t))
    for sign in (1, -1):
        other = np.array(oscillation(found.t, J + sign * sigma)[0])
        shares = np.abs(other - np.array(own) - sign * first_order)[:, 1:]
        shares = shares / np.maximum.accumulate(np.abs(first_order), axis=1)[:, 1:]
        off[1:] = np.maximum(off[1:], shares.max(axis=0))
    assert got.departure == pytest.approx(np.maximum.accumulate(off), abs=1e-9)
    assert got.departure[-1] > LINEAR > got.departure[1]
    last = int((got.departure <= LINEAR).sum()) - 1
    assert got.linear_until == found.t[last]
    assert f"holds until {got.linear_until:.6g} s" in got.note


@pytest.mark.slow
def test_deviations_are_those_of_many_draws(random):
    names = ("q1", "u2", "m2", "g")
    own = sensitivity(replace(Scene.load("free_fall"), duration=1.0), names, samples=11)
    sigmas = dict(zip(names, (1e-5, 2e-5, 1e-5, 3e-5), strict=True))
    got = own.uncertainty(sigmas)
    slopes = np.concatenate([own.dq, own.du], axis=1)
    draws = random.normal(size=(20_000, 4)) * list(sigmas.values())
    spread = np.einsum("dk,kin->din", draws, slopes).std(axis=0)
    # 20 000 draws know a deviation to 1/√40 000 = 0.5 %: four of these.
    assert spread[:, 1:] == pytest.approx(got.deviation[:, 1:], rel=0.02)


def test_errors_of_deviations_follow_from_those_of_derivatives(found):
    got = found.uncertainty({"start.q.0": 0.1, "start.u.0": 0.2})
    assert got.error == pytest.approx(0.1 * found.errors[0] + 0.2 * found.errors[1])
    assert got.error.max() < 1e-12


def test_a_covariance_is_the_product_of_its_factor(random):
    A = random.normal(size=(3, 3))
    C = A @ A.T
    C = (C + C.T) / 2
    F = factor_of(("a", "b", "c"), None, C)
    assert pytest.approx(C, abs=1e-14) == F @ F.T
    assert factor_of(("a", "b"), {"b": 2.0}, None).tolist() == [[0, 0], [0, 2]]


def test_the_units_of_parameters_do_not_matter(random):
    """Eigenvalues of the covariance itself have the round-off of 1e4², far above that of 1e-5²."""
    deviations = np.array([1e-5, 1e-5, 1e4, 0.0])
    rows = random.normal(size=(4, 4))
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    C = (rows @ rows.T) * np.outer(deviations, deviations)
    C = (C + C.T) / 2
    F = factor_of(("q1", "q2", "stiffness", "m1"), None, C)
    scale = np.outer(deviations, deviations)
    assert np.abs(F @ F.T - C)[:3, :3] / scale[:3, :3] == pytest.approx(np.zeros((3, 3)), abs=1e-14)
    assert not F[3].any()


@pytest.mark.parametrize(
    ("deviations", "covariance", "sentence"),
    [
        (None, None, "uncertainty must have deviations or a covariance; got none"),
        ({"start.q.0": 1.0}, np.eye(3), "uncertainty must have deviations or a covariance; got b"),
        ({"q7": 1.0}, None, "deviations must be of start.q.0, start.u.0, chain.mass.1; got 'q7'"),
        ({"start.q.0": -1.0}, None, "the deviation of start.q.0 must be zero or positive"),
        ({"start.q.0": "x"}, None, "the deviation of start.q.0 must be a number"),
        (
            {"start.q.0": sympy.Symbol("x")},
            None,
            "the deviation of start.q.0 must be zero or positive, and finite; got x",
        ),
        ([1.0], None, "deviations must be a mapping"),
        (None, np.full((3, 3), sympy.Symbol("x")), "covariance must be a 3 × 3 array of numbers"),
        (None, np.full((3, 3), 10**400), "covariance must be a 3 × 3 array of "),
        (None, np.eye(2), "covariance must be a 3 × 3 array of finite numbers"),
        (None, "x", "covariance must be a 3 × 3 array of numbers"),
        (None, np.full((3, 3), np.nan), "covariance must be a 3 × 3 array of finite numbers"),
        (None, np.diag([1.0, 1.0, -1.0]), "covariance must be symmetric and positive semidefinite"),
        (None, np.eye(3, k=1), "covariance must be symmetric and positive semidefinite"),
        (
            None,
            np.array([[1e-20, 2e-20, 0.0], [2e-20, 1e-20, 0.0], [0.0, 0.0, 1.0]]),
            "covariance must be symmetric and positive semidefinite",
        ),
        (
            None,
            np.array([[0.0, 1e-9, 0.0], [1e-9, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            "covariance must be symmetric and positive semidefinite",
        ),
        (None, np.eye(3).astype(str), "covariance must be a 3 × 3 array of numbers"),
        (None, np.eye(3) + 0j, "covariance must be a 3 × 3 array of numbers"),
    ],
)
def test_what_is_no_uncertainty_is_refused(found, deviations, covariance, sentence):
    with pytest.raises(ParameterError, match=sentence):
        found.uncertainty(deviations, covariance=covariance)


def test_a_deviation_that_no_scene_survives_is_refused(found):
    with pytest.raises(ParameterError, match="link 2: mass must be a positive number"):
        found.uncertainty({"chain.mass.1": 2.0})


def test_the_summary_has_six_times(found):
    got = found.uncertainty({"start.q.0": 0.1})
    assert len(got.summary().rows) == 6
    assert got.summary().rows[0][1].text == "0.1"
