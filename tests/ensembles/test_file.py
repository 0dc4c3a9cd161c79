from pathlib import Path

import pytest

from tests.ensembles.cases import axis, ensemble, starts
from twolink.data import data_path
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.file import ensemble_of, load
from twolink.errors import SceneError
from twolink.scene import Scene

TEXT = """
title = "Which starts flip"
scene = "free_fall"
[[axes]]
parameter = "start.q.0"
name = "q1"
grid = {first = -3.0, last = 3.0, count = 5}
[[axes]]
parameter = "start.u.1"
normal = {mean = 0.0, deviation = 0.5}
[runs]
draws = 3
seed = 12
accuracy = 1e-7
[keep]
final = true
samples = 11
first = [{name = "flip", of = "either"}, {name = "down", of = "q1", level = 1.0}]
"""


def test_a_file_is_read_with_all_its_keys(tmp_path):
    file = tmp_path / "flips.toml"
    file.write_text(TEXT)
    found = load(file)
    assert found.title == "Which starts flip"
    assert [axis.name for axis in found.runs.axes] == ["q1", "start_u_1"]
    assert found.runs.shape == (5, 3)
    assert (found.accuracy, found.duration) == (1e-7, 10.0)
    names = [variable.name for variable in found.variables]
    assert names == [
        *("q", "u", "q_samples"),
        *("flip_time", "flip_bound", "flip_verdict"),
        *("down_time", "down_bound", "down_verdict"),
        *("error", "precision", "limit"),
    ]


def test_a_scene_is_a_name_a_file_beside_it_a_table_or_an_object(tmp_path):
    scene = Scene.load("free_fall")
    (tmp_path / "mine.toml").write_text(scene.to_toml())
    file = tmp_path / "sweep.toml"
    file.write_text('scene = "mine.toml"\n')
    documents = [
        load(file).document,
        ensemble(scene=scene).document,
        ensemble(scene="free_fall").document,
    ]
    assert documents[0] == documents[1]
    runs = [{**document["scene"], "shows": ""} for document in documents]
    assert runs[0]["chain"] == runs[2]["chain"]


def test_the_same_sweep_has_the_same_fingerprint_and_another_has_not():
    assert starts().fingerprint == starts().fingerprint
    others = [
        starts(count=7),
        starts(keep={"final": True}),
        starts(runs={"accuracy": 1e-7, "duration": 3.0}),
        starts(runs={"accuracy": 1e-6, "duration": 3.0, "refine": True}),
    ]
    assert len({starts().fingerprint, *(other.fingerprint for other in others)}) == 5


def test_another_urdf_of_the_same_name_has_another_fingerprint(tmp_path):
    """Or a store would be continued with the motions of another chain."""
    text = data_path("twolink.urdf").read_text(encoding="utf-8")
    scene = {"chain": {"urdf": "a.urdf"}, "start": {"theta": [0.0, 0.0]}, "run": {"duration": 1.0}}
    found = []
    for name in ("here", "there", "other"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "a.urdf").write_text(
            text.replace('<mass value="', '<mass value="1') if name == "other" else text
        )
        found.append(ensemble_of({"scene": scene}, "<dict>", folder).fingerprint)
    assert found[0] == found[1] != found[2]


Q = axis("start.q.0", 1.0)
NORMAL = {"parameter": "start.q.1", "normal": {"mean": 0.0, "deviation": 1.0}}


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"scen": 1}, "a key of the sweep must be one of title, scene, axes, runs, keep; got 'sce"),
        ({"axes": [{**Q, "valeus": 1}]}, "a key of axes must be one of parameter, name, grid, val"),
        (
            {"axes": [{"parameter": "start.q.0"}]},
            "axes.0 must have one of grid, values, uniform or",
        ),
        ({"axes": [{**Q, "grid": {"first": 0.0, "last": 1.0, "count": 2}}]}, "got grid and values"),
        (
            {"axes": [axis("start.q.0", grid={"first": 0, "last": 1, "count": 2, "n": 2})]},
            "a key of axes.grid",
        ),
        ({"axes": [Q, Q]}, "axes.1.parameter must be of no other axis; got 'start.q.0'"),
        ({"axes": [NORMAL]}, "runs.draws must be given where an axis is random; got none"),
        ({"axes": [Q], "runs": {"draws": 3}}, "runs.draws must be of a sweep with a uniform or n"),
        ({"axes": [{**Q, "name": "a b"}]}, "axes.0.name must be letters, digits and underscores"),
        (
            {"axes": [{**Q, "name": "a" * 256}]},
            r"axes and kept quantities must have 255 bytes or fewer; got 'a+\.+a+' of 256",
        ),
        ({"axes": [{**Q, "name": "ä" * 128}]}, r"255 bytes or fewer; got 'ä.*' of 256"),
        (
            {"keep": {"first": [{"name": "a" * 255}]}},
            r"255 bytes or fewer; got 'a+\.+.*' of \d+",
        ),
        ({"axes": [{**Q, "name": "error"}]}, "the names of axes must not be those of results"),
        ({"axes": [{**Q, "name": "draw"}]}, "the names of axes must not be those of results"),
        (
            {"axes": [{**Q, "name": "link"}], "keep": {"final": True}},
            "the names of axes must not be those of results",
        ),
        ({"axes": [{**Q, "name": "q"}], "keep": {"final": True}}, "must be different; got 'q' tw"),
        ({"keep": {"finl": True}}, r"a key of keep must be one of .*; got 'finl' \(did you mean"),
        ({"keep": {"samples": 1}}, "keep.samples must be a whole number of 2 or more; got 1"),
        ({"keep": {"first": [{"of": "q3"}]}}, "keep.first.0.of must be one of q1, q2, elbow, eit"),
        ({"keep": {"first": [{"of": "elbow"}]}}, "keep.first: level must be given for the elbow"),
        ({"runs": {"accuracy": 0.0}}, "runs.accuracy must be greater than 0; got 0.0"),
        ({"axes": 3}, "axes must be a list of tables; got 3"),
        ({"axes": [3]}, r"axes must be a list of tables; got \(3,\)"),
        ({"axes": [Q, 3]}, "axes.1 must be a table; got 3"),
        ({"keep": {"first": 3}}, "keep.first must be a list of tables; got 3"),
        ({"runs": []}, "runs must be a table; got"),
        ({"scene": 3}, "scene must be a valid string; got 3"),
        ({"scene": "fre_fall"}, r"there is no scene and no file of this name; did you mean free_f"),
        ({"scene": {"chain": {}}}, "scene: key 'start' is missing; it must be given"),
        (
            {"axes": [axis("start.q.0", grid={"first": 0.0, "last": 1.0, "count": 2_000_000_000})]},
            "a sweep must have 1000000000 runs or fewer; got 2000000000",
        ),
    ],
)
def test_contradictory_tables_are_refused_in_one_sentence(tables, sentence):
    with pytest.raises(SceneError, match=sentence) as caught:
        ensemble(**tables)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('scene = "drop', "a sweep file must be TOML; got another text"),
        ("<robot name='arm'>", "a sweep file must be TOML; got a URDF"),
        (f"x = {'[' * 20}{']' * 20}", "must not be nested deeper than those of a sweep file"),
    ],
)
def test_another_text_is_no_sweep_file(tmp_path, text, sentence):
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(SceneError, match=sentence):
        load(tmp_path / "s.toml")


def test_a_name_that_a_file_can_have_is_read():
    longest = "ä" * 127
    assert ensemble(axes=[{**Q, "name": longest}]).runs.axes[0].name == longest


def test_a_sweep_without_axes_is_one_run(tmp_path):
    (tmp_path / "a.toml").write_text(
        'axes = []\nscene = "free_fall"\n[keep]\nfinal = true\nfirst = []\n'
    )
    found = load(tmp_path / "a.toml")
    without = ensemble(keep={"final": True, "first": []})
    assert found.runs.count == without.runs.count == 1
    assert found.kept == without.kept
    assert found.fingerprint == without.fingerprint
    rows = rows_of(found, 0, 1)
    assert rows.reasons == [""]
    assert rows.arrays["q"].shape == (1, 2)


def test_a_method_that_measures_no_error_in_lanes_is_refused(tmp_path):
    (tmp_path / "a.toml").write_text(
        Scene.load("free_fall").to_toml().replace("[run]", '[run]\nmethod = "rk4"')
    )
    with pytest.raises(SceneError, match=r"the method of the scene must be taylor.*got 'rk4'"):
        ensemble(scene=str(Path(tmp_path / "a.toml")))


def test_a_flip_needs_gravity():
    scene = {
        "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
        "start": {"q": [0.0, 0.0]},
        "run": {"duration": 1.0},
    }
    with pytest.raises(SceneError, match="in a scene without gravity"):
        ensemble(scene=scene, keep={"first": [{}]})
