from fractions import Fraction
from math import factorial

import numpy as np
import pytest

from twolink.ensembles.speeds import derivatives, truncation_within
from twolink.integration.precisions import PRECISIONS

ORDER, LENGTHS = 11, (0.3, 0.5)


def sines(kind):
    """Return the series of q1 = sin t and q2 = cos t on two steps, and u at their ends."""
    starts = (0.2, 1.1)
    angles = np.zeros((2, 2, ORDER + 1), dtype=object)
    ends = np.zeros((2, 2), dtype=object)
    for n, (t, h) in enumerate(zip(starts, LENGTHS, strict=True)):
        # sin, cos, −sin, −cos at t and at the end.
        cycle = [np.sin(t), np.cos(t), -np.sin(t), -np.cos(t)]
        for k in range(ORDER + 1):
            angles[n, :, k] = [kind(cycle[(k + v) % 4]) / factorial(k) for v in (0, 1)]
        ends[n] = [kind(np.cos(t + h)), kind(-np.sin(t + h))]
    return angles, np.array([kind(h) for h in LENGTHS]), ends


@pytest.mark.parametrize("precision", PRECISIONS)
def test_speeds_of_a_sine_are_within_their_truncation(precision):
    kind = PRECISIONS[precision].number
    angles, lengths, ends = sines(kind)
    typed = (np.array(x.tolist(), dtype=lengths.dtype) for x in (angles, ends))
    angles, ends = typed
    found = derivatives(angles, lengths, ends).astype(float)
    cut = truncation_within(found[..., None])[..., 0]
    assert (cut < 0.2 * np.abs(found[:, :, -2:]).sum(axis=2)).all()
    for n, (t, h) in enumerate(zip((0.2, 1.1), LENGTHS, strict=True)):
        for x in np.linspace(0, 1, 11):
            true = np.array([np.cos(t + x * h), -np.sin(t + x * h)])
            value = found[n] @ x ** np.arange(ORDER + 1.0)
            assert (np.abs(value - true) <= cut[n] + 4e-16).all()
    # The last term is that of the series, but for the terms beyond it.
    h = LENGTHS[1]
    last = np.cos(1.1 + ORDER * np.pi / 2) * h**ORDER / factorial(ORDER)
    assert found[1, 0, -1] == pytest.approx(last, abs=h ** (ORDER + 1) / factorial(ORDER + 1) * 1.1)


def test_a_step_of_no_length_has_the_speed_at_its_end():
    angles, ends = np.zeros((1, 2, 5, 1)), np.array([[[2.0], [-3.0]]])
    angles[:, :, 1] = ends
    found = derivatives(angles, np.zeros((1, 1)), ends)
    assert found[0, :, 0, 0].tolist() == [2.0, -3.0]
    assert not found[0, :, 1:].any()


def test_powers_end_as_the_bound_on_truncation_assumes():
    """(j − p)/(e p) is above |x^j − x^p| on [0, 1], whose largest value is at (p/j)^(1/(j − p))."""
    for p in (5, 11, 21, 41):
        for j in range(p + 1, p + 30):
            x = (p / j) ** (1 / (j - p))
            assert x**p - x**j < (j - p) / (np.e * p)
    assert sum(Fraction(i + 1, 2**i) for i in range(60)) < 4
