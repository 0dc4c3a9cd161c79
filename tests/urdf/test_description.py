import json
import math
from dataclasses import asdict

import pytest

from tests.urdf.drawing import arm, at, axis, joint, link
from twolink import UrdfError
from twolink.urdf import parse_planar_urdf
from twolink.urdf.description import describe, drawing, read_description, tree_lines

LUMPED = arm(tool=link("tool"), mount=joint("mount", "hand", "tool", "fixed", at("0.1 0.2 0.3")))
HANGING = arm(
    shoulder=joint("shoulder", "ground", "upper", inside=at("0 0 2", "0 1.5707963267948966 0")),
)


def test_the_description_has_the_values_that_were_read():
    described, read = describe(LUMPED), parse_planar_urdf(LUMPED)
    assert tuple(body.parameters for body in described.bodies) == read.links
    assert (described.sign, described.offset) == (read.joints.sign, read.joints.offset)
    assert (described.origin, described.axes) == (read.origin, read.axes)
    assert (described.gravity, described.tip, described.notes) == (9.81, read.tip, read.notes)
    assert [body.joint for body in described.bodies] == ["shoulder", "elbow"]


def test_lumped_links_are_described_with_mass_and_position():
    described = describe(LUMPED)
    parts = {part.link: (part.mass, part.position) for part in described.bodies[1].parts}
    assert parts["lower"] == (1.0, (0.0, 0.0, 0.0))
    assert parts["hand"] == (0.0, (1.0, 0.0, 0.0))
    assert parts["tool"] == (1.0, (1.1, 0.2, 0.3))
    assert described.grounded == (described.root,) == ("ground",)
    lines = "\n".join(tree_lines(described))
    for words in (
        "'ground' does not move",
        "'tool', 1 kg, at (1.1, 0.2, 0.3) m",
        "about (0, 1, 0)",
    ):
        assert words in lines


def test_axes_are_in_the_world():
    text = arm(
        shoulder=joint("shoulder", "ground", "upper", inside=axis("0 -2 0") + at("0 0 0", "0 0 1"))
    )
    assert describe(text).bodies[0].axis == pytest.approx((math.sin(1), -math.cos(1), 0))


def test_the_drawing():
    assert drawing(describe(arm())) == "A" + "·" * 14 + "1" + "·" * 14 + "B" + "·" * 14 + "2" + (
        "·" * 14 + "D"
    )
    rows = drawing(describe(HANGING)).splitlines()
    assert rows[0] == "A"
    assert {"1", "B", "2", "·"} <= set(rows)
    assert rows[-1] == "D"
    assert len(rows) == 15
    # No finite size to draw.
    far = arm(elbow=joint("elbow", "upper", "lower", inside=at("8e307 0 0")))
    assert drawing(describe(far))


def test_a_description_is_json():
    document = json.loads(json.dumps(asdict(describe(LUMPED))))
    assert document["bodies"][1]["parts"][2]["link"] == "tool"


def test_a_file_that_is_refused(tmp_path):
    with pytest.raises(UrdfError, match="no file"):
        read_description(tmp_path / "none.urdf")
