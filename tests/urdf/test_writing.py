"""Chain → URDF → Chain loses nothing, and the shipped file is what the library writes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.strategies import chains, decades, sizes
from tests.symbols import CHAIN
from twolink.chain import Chain
from twolink.errors import ParameterError
from twolink.shipped import shipped
from twolink.urdf import parse_planar_urdf

SHIPPED = shipped("twolink.urdf").read_text(encoding="utf-8")


def parameters(chain: Chain) -> list[float]:
    pairs = (chain.mass, chain.length, *chain.centre, chain.inertia)
    return [number for pair in pairs for number in pair]


def assert_round_trip(chain: Chain) -> None:
    read = Chain.from_links(parse_planar_urdf(chain.to_urdf()).links)
    for before, after in zip(parameters(chain), parameters(read), strict=True):
        assert abs(after - before) <= math.ulp(before), (chain, read)


@given(chain=chains())
def test_round_trip_of_any_proportion(chain):
    assert_round_trip(chain)


@given(
    numbers=st.lists(decades(-100, 100), min_size=6, max_size=6),
    centre=st.lists(sizes(1e-100, 1e100), min_size=4, max_size=4),
)
def test_round_trip_of_extreme_values(numbers, centre):
    m1, m2, L1, L2, I1, I2 = numbers
    a1, b1, a2, b2 = centre
    assert_round_trip(Chain((m1, m2), (L1, L2), ((a1, b1), (a2, b2)), (I1, I2)))


@pytest.mark.parametrize(
    "chain",
    [
        Chain.uniform_bars(),
        Chain.uniform_bars((0.1, 3.0), (0.7, 1 / 3)),
        Chain.point_masses((2.0, 1.0), (0.3, 0.1)),
        Chain((1.0, 1.0), (1.0, 0.0), ((-0.5, 0.2), (0.0, -0.3)), (0.1, 0.0)),
        Chain((1.0, 1.0), (1.0, 1.0), ((3.0, 0.0), (-2.0, 0.0)), (0.0, 0.1)),
    ],
)
def test_round_trip_of_special_chains(chain):
    assert_round_trip(chain)


def test_the_shipped_file_is_the_sources_chain(tmp_path):
    """Made by: python -c "from twolink import Chain; Chain.uniform_bars().to_urdf('…')"."""
    path = tmp_path / "twolink.urdf"
    assert Chain.uniform_bars().to_urdf(path) == SHIPPED
    assert path.read_text(encoding="utf-8") == SHIPPED
    assert Chain.from_urdf(shipped("twolink.urdf")) == Chain.uniform_bars()


def test_the_shipped_file_is_physical():
    """Transverse inertia exactly mL²/12; a positive axial one within the triangle inequality."""
    assert SHIPPED.count(f'iyy="{1 / 12!r}"') == 2
    axial = 0.02**2 / 2
    assert SHIPPED.count(f'ixx="{axial!r}"') == 2
    assert 0 < axial <= 2 / 12


def test_numpy_floats_are_written_as_numbers():
    chain = Chain.uniform_bars(tuple(np.array([0.1, 3.0])), tuple(np.array([0.7, 0.2])))
    assert "np." not in chain.to_urdf()
    assert_round_trip(chain)


def test_symbols_have_no_urdf():
    with pytest.raises(ParameterError, match="allowed are parameters that are numbers"):
        CHAIN.to_urdf()


def test_points_are_marked_by_frames():
    urdf = parse_planar_urdf(SHIPPED)
    assert (urdf.tip, urdf.assumptions) == ("D", ())
    for name in ("A", "B", "C1", "C2", "D"):
        assert f'<link name="{name}">' in SHIPPED
