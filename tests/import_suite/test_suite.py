"""The import suite against our reader, Pinocchio and yourdfpy; and mutations of its files."""

import io
import json
import math
import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from tests.import_suite.index import FOLDER, INDEX, INVALID, VALID, named
from tests.import_suite.truth import ANGLES, gravity_torque, mass_matrix, tip, worst
from tests.import_suite.writing import suite, write_suite
from twolink import TwolinkError, UrdfError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.urdf import parse_planar_urdf, read_planar_urdf
from twolink.urdf.description import describe
from twolink.urdf.repair import repair_file, repair_urdf
from twolink.urdf.sdf import sdf_of
from twolink.verification import verify

# Parameters go through some tens of operations in space, of numbers with 16 digits each.
CLOSE = 1e-13

# docs/bugs.md says why; repaired, each of them is read.
REFUSED_BY_PINOCCHIO = ("vector-over-two-lines",)

valid = pytest.mark.parametrize("test", VALID, ids=named)
invalid = pytest.mark.parametrize("test", INVALID, ids=named)


def same_text(one: bytes, two: bytes) -> bool:
    """Return whether two texts are equal but for the last digits of numbers."""
    number = re.compile(rb"-?\d[\d.]*(?:e-?\d+)?")
    if number.sub(b"#", one) != number.sub(b"#", two):
        return False
    pairs = zip(number.findall(one), number.findall(two), strict=True)
    return all(math.isclose(float(a), float(b), rel_tol=1e-12, abs_tol=1e-12) for a, b in pairs)


def test_the_stored_files_are_those_that_the_command_writes(tmp_path):
    files = suite()
    assert {f.relative_to(FOLDER).as_posix() for f in FOLDER.rglob("*.*")} == set(files)
    for path, content in files.items():
        if path == "index.json":
            stored = json.loads((FOLDER / path).read_text(encoding="utf-8"))
            fresh = json.loads(content)
            assert [t["id"] for t in stored["tests"]] == [t["id"] for t in fresh["tests"]]
        elif b"1.5e" not in content and not same_text(content, (FOLDER / path).read_bytes()):
            raise AssertionError(path)
    stray = tmp_path / "valid" / "stray.urdf"
    stray.parent.mkdir()
    stray.write_text("")
    write_suite(tmp_path)
    assert not stray.exists()
    assert (tmp_path / "index.json").read_bytes() == files["index.json"]


def test_the_suite_is_as_large_as_it_says():
    assert len(VALID) >= 30
    assert len(INVALID) >= 30
    ids = [test["id"] for test in INDEX["tests"]]
    assert len(set(ids)) == len(ids)
    assert all(test["flags"] and test["comment"] for test in INDEX["tests"])


@valid
def test_our_reader_finds_the_parameters(test):
    expected = test["parameters"]
    read = read_planar_urdf(FOLDER / test["file"])
    for link, theirs in zip(read.links, expected["links"], strict=True):
        size = max(link.length, math.hypot(*link.centre))
        assert link.mass == pytest.approx(theirs["mass"], rel=CLOSE)
        assert link.length == pytest.approx(theirs["length"], rel=CLOSE)
        assert link.centre == pytest.approx(theirs["centre"], rel=0, abs=CLOSE * size)
        # The parallel-axis theorem's terms are rounded too.
        about_end = theirs["inertia"] + link.mass * size**2
        assert link.inertia == pytest.approx(theirs["inertia"], rel=0, abs=CLOSE * about_end)
    assert list(read.joints.sign) == expected["sign"]
    assert read.joints.offset == pytest.approx(expected["offset"], rel=0, abs=CLOSE)
    np.testing.assert_allclose(read.axes, expected["plane"], rtol=0, atol=CLOSE)
    np.testing.assert_allclose(read.origin, expected["origin"], rtol=0, atol=CLOSE)
    assert read.gravity == pytest.approx(expected["gravity"], rel=CLOSE, abs=0)
    assert list(read.damping) == expected["damping"]
    assert list(read.friction) == expected["friction"]
    assert [None if x is None else list(x) for x in read.limits] == expected["limits"]
    assert read.tip == "D"


@valid
def test_every_valid_file_can_be_shown_and_needs_no_repair_of_its_mechanics(test):
    path = FOLDER / test["file"]
    read = read_planar_urdf(path)
    assert describe(read.xml).bodies[0].parameters == read.links[0]
    repaired = repair_file(path)
    again = parse_planar_urdf(repaired.text)
    # The moment about the axis of an inertia that is made isotropic is the same but for rounding.
    for link, before in zip(again.links, read.links, strict=True):
        assert (link.mass, link.length, link.centre) == (before.mass, before.length, before.centre)
        assert link.inertia == pytest.approx(before.inertia, rel=1e-14)
    assert again.joints == read.joints
    assert repair_urdf(repaired.text).changes == ()
    assert repair_urdf(repaired.text).text == repaired.text


def pinocchio_of(text, names, theta):
    """Return Pinocchio's model of a text, its data, and its configuration."""
    model = pin.buildModelFromXML(text)
    q = pin.neutral(model)
    for name, angle in zip(names, theta, strict=True):
        joint = model.getJointId(name)
        start = model.idx_qs[joint]
        values = [angle] if model.nqs[joint] == 1 else [math.cos(angle), math.sin(angle)]
        q[start : start + len(values)] = values
    return model, model.createData(), q


@valid
@pytest.mark.parametrize("theta", ANGLES)
def test_pinocchio_agrees(test, theta):
    text = read_planar_urdf(FOLDER / test["file"]).xml
    if named(test) in REFUSED_BY_PINOCCHIO:
        with pytest.raises(ValueError, match="does not contain a valid URDF"):
            pin.buildModelFromXML(text)
        text = repair_urdf(text).text
    expected = test["parameters"]
    model, data, q = pinocchio_of(text, ("shoulder", "elbow"), theta)
    # crba fills the upper triangle alone; the joints may stand in any order in the file.
    M = np.triu(pin.crba(model, data, q))
    M = M + np.triu(M, 1).T
    order = [model.idx_vs[model.getJointId(name)] for name in ("shoulder", "elbow")]
    assert worst(mass_matrix(expected, theta), M[np.ix_(order, order)]) < CLOSE
    torque = -pin.computeGeneralizedGravity(model, data, q)[order]
    one, two = expected["links"]
    size = 9.81 * (one["mass"] + 2 * two["mass"]) * one["length"]
    np.testing.assert_allclose(torque, gravity_torque(expected, theta), rtol=0, atol=CLOSE * size)


@valid
def test_yourdfpy_agrees(test):
    text = read_planar_urdf(FOLDER / test["file"]).xml
    expected = test["parameters"]
    content = re.sub(r"<\?xml[^>]*\?>", "", text).replace("xmlns=", "about=").encode()
    model = yourdfpy.URDF.load(io.BytesIO(content), load_meshes=False)
    size = sum(link["length"] for link in expected["links"])
    normal = np.array(expected["plane"])[2]
    for theta in ANGLES:
        # A limit of 3 rad is beyond all of these.
        model.update_cfg(dict(zip(("shoulder", "elbow"), theta, strict=True)))
        theirs = model.get_transform("D", "base")[:3, 3]
        off = theirs - tip(expected, theta)
        np.testing.assert_allclose(off - (off @ normal) * normal, 0, atol=1e-12 * size)


@invalid
def test_every_invalid_file_is_refused_for_its_reason(test):
    path = FOLDER / test["file"]
    with pytest.raises(UrdfError) as caught:
        read_planar_urdf(path)
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}: ")
    assert "\n" not in sentence
    for words in test["reason"]:
        assert words in sentence, (words, sentence)


@invalid
def test_repair_removes_the_faults_that_the_index_says(test):
    path = FOLDER / test["file"]
    if not test["repairable"]:
        with pytest.raises(UrdfError, match=re.escape(f"{path}: ")):
            repair_file(path)
        return
    repaired = repair_file(path)
    assert repaired.changes
    plain = read_planar_urdf(FOLDER / "valid" / "plain.urdf")
    assert parse_planar_urdf(repaired.text).links == plain.links
    assert pin.buildModelFromXML(repaired.text).nv == 2


# Mutations: none of our commands answers with anything but a sentence.

WORDS = (
    "", "nan", "-1", "1e308", "1e-308", "0", "fixed", "world", "base", "é", "${x}", "<", "&", "'",
    "xmlns='u'", "<link/>", "<joint/>", "<axis/>", "<limit/>", "<!--", "\x00", "\ufeff", "x" * 999,
)  # fmt: skip


def mutated(random: np.random.Generator, text: str) -> str:
    """Return a text with some of its words removed, doubled, exchanged, or replaced."""
    words = re.split(r'([<>"=\s])', text)
    for _ in range(int(random.integers(1, 4))):
        at, other = (int(random.integers(len(words))) for _ in "ab")
        match random.integers(6):
            case 0:
                words[at] = ""
            case 1:
                words[at] = WORDS[random.integers(len(WORDS))]
            case 2:
                words[at], words[other] = words[other], words[at]
            case 3:
                words[at] += words[at]
            case 4:
                del words[at : at + int(random.integers(1, 12))]
            case _:
                words[at:at] = words[other : other + int(random.integers(1, 12))]
    return "".join(words)


SCENE = """
[chain]
urdf = "mutant.urdf"
[start]
theta = [0.1, 0.2]
omega = [0.3, -0.1]
[run]
duration = 0.01
accuracy = 1e-3
method = "rk4"
[effects.gravity]
"""

# The commands that read a URDF file, by name.
COMMANDS = {
    "show": lambda file: describe(read_planar_urdf(file).xml),
    "repair": repair_file,
    "verify": lambda file: verify(file, states=1),
    "simulate": lambda file: simulate(Scene.parse(SCENE, folder=file.parent), samples=3),
    "convert to SDF": lambda file: sdf_of(read_planar_urdf(file).xml),
}


def no_traceback(texts: list[str], random: np.random.Generator, count: int, folder: Path) -> int:
    """Give mutants of texts to every command; return how often one accepted a mutant."""
    accepted = 0
    for number in range(count):
        text = mutated(random, texts[number % len(texts)])
        file = folder / "mutant.urdf"
        file.write_text(text, encoding="utf-8", errors="replace")
        for name, command in COMMANDS.items():
            sentence = ""
            try:
                command(file)
                accepted += 1
            except TwolinkError as error:
                sentence = str(error)
            except Exception as error:
                raise AssertionError(f"{name}: {type(error).__name__}: {error}\n{text}") from error
            assert "\n" not in sentence, text
            assert len(sentence) < 1000, text
    return accepted


def texts() -> list[str]:
    return [read_planar_urdf(FOLDER / test["file"]).xml for test in VALID]


@pytest.mark.slow
def test_mutants_are_answered_with_a_sentence(tmp_path):
    assert no_traceback(texts(), np.random.default_rng(7), 100, tmp_path) > 20


@pytest.mark.long
@pytest.mark.slow
def test_thousands_of_mutants_are_answered_with_a_sentence(tmp_path):
    assert no_traceback(texts(), np.random.default_rng(8), 3000, tmp_path) > 300


def test_pinocchio_ignores_mimic_unless_it_is_asked_for():
    text = (FOLDER / "invalid" / "mimic.urdf").read_text(encoding="utf-8")
    assert pin.buildModelFromXML(text).nv == 2
    assert pin.buildModelFromXML(text, mimic=True).nv == 1
