"""A trajectory as text, in notebooks, and as data frames."""

import html
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from twolink.errors import PictureError, SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate


@pytest.fixture(scope="module")
def drop():
    return simulate(Scene.load("drop"), samples=51)


def test_the_text_is_short_and_has_the_facts_that_simulate_prints(drop):
    text = repr(drop)
    assert text.startswith("<Trajectory of 'The drop onto a floor': 51 samples, 6 events, ")
    assert len(text) < 700
    for words in ("5 s with Gravity, Surface", "measured, 1.0e-09 allowed", "q at the end"):
        assert words in text
    assert [row[1].text for row in drop.summary().rows] == list(drop.facts.values())


@pytest.mark.slow
def test_the_cell_of_a_notebook_has_the_player_the_facts_and_the_log(drop):
    page = drop._repr_html_()
    assert page.startswith('<iframe title="Motion: The drop onto a floor" srcdoc="')
    frame, _, rest = page.partition("</iframe>")
    assert "twolink-player" in frame
    tables = ET.fromstring(f"<div>{rest}</div>").findall("table")
    assert [each.find("caption").text for each in tables] == [
        "The drop onto a floor",
        "Modes and impacts",
    ]
    assert f"D hits floor {len(drop.impacts) - 1} times" in rest


@pytest.mark.slow
def test_a_motion_that_cannot_be_filmed_has_its_facts():
    few = simulate(Scene.load("free_fall"), method="DOP853", accuracy=1e-6, samples=2)
    page = few._repr_html_()
    with pytest.raises(PictureError) as refused:
        few.show()
    assert html.escape(str(refused.value)) in page
    words = "".join(ET.fromstring(f"<page>{page}</page>").itertext())
    assert "measured, 1.0e-06 allowed" in words


def test_columns_have_units_and_joint_angles_where_there_are_some(drop):
    found = drop.columns()
    assert list(found) == [
        "t_s", "q1_rad", "q2_rad", "u1_rad_per_s", "u2_rad_per_s", "T_J", "V_J",
    ]  # fmt: skip
    assert np.array_equal(found["u2_rad_per_s"], drop.u[1])
    assert np.array_equal(found["T_J"], drop.kinetic_energy)


def test_a_data_frame_has_the_columns(drop):
    frame = drop.to_pandas()
    assert frame.index.name == "t_s"
    assert np.array_equal(frame.index, drop.t)
    assert np.array_equal(frame["q1_rad"], drop.q[0])
    assert frame.loc[0.0, "q1_rad"] == drop.scene.q[0]
    assert frame.attrs["method"] == drop.facts["method"]


def test_a_dataset_has_dimensions_and_units(drop):
    dataset = drop.to_xarray()
    assert dataset["q"].dims == ("link", "t")
    assert dataset["u"].attrs["units"] == "rad/s"
    assert float(dataset["q"].sel(link=2).isel(t=-1)) == drop.q[1, -1]
    assert np.array_equal(dataset["V"], drop.potential_energy)
    assert dataset.attrs["title"] == drop.scene.title


@pytest.mark.parametrize("package", ["pandas", "xarray"])
def test_a_missing_package_is_named_with_its_extra(drop, monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(
        SimulationError, match=rf'{package} is not installed; .*"twolink\[frames\]"'
    ):
        getattr(drop, f"to_{package}")()


def test_notes_are_in_the_text_and_in_a_notebook():
    run = simulate(Scene.load("elbow_and_tip"), samples=3)
    (note,) = run.notes
    assert f"\n  {note}>" in repr(run)
    assert note in run._repr_html_()
