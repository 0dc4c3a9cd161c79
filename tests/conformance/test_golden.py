"""The golden vectors as files: checked against their schema, checksums and index."""

import functools
import hashlib
import json
import re
import subprocess

import numpy as np
import pytest

from twolink.conformance.flags import FLAGS
from twolink.conformance.golden import CHECKSUMS, PAGE, golden_files, read_group, write_golden
from twolink.conformance.suites import SUITES, suite
from twolink.errors import FileError, ParameterError

files = functools.cache(golden_files)


@functools.cache
def groups():
    return {path: own for path, own in files().items() if path.split("/")[0] in SUITES}


def test_every_group_has_a_file_that_reads_back():
    every = [group for name in SUITES for group in suite(name)]
    assert len(groups()) == len(every)
    read = {found.group.id: found for found in map(read_group, groups().values())}
    for group in every:
        assert read[group.id].group == group


def test_ids_are_unique_and_flags_have_notes():
    ids, used = [], set()
    for name in SUITES:
        for group in suite(name):
            ids += [group.id, *(test.id for test in (*group.tests, *group.motions))]
            used |= {*group.flags, *(flag for test in group.tests for flag in test.flags)}
    assert len(ids) == len(set(ids))
    assert used == set(FLAGS)


def test_numbers_have_thirty_digits_and_positive_bounds():
    for name in SUITES:
        for group in suite(name):
            for test in group.tests:
                values, bounds = np.array(test.values), np.array(test.bound)
                assert values.shape == bounds.shape
                assert (bounds >= 0).all()
                for word in values.flat:
                    assert word == "0" or re.fullmatch(r"-?\d\.\d{29}e[+-]\d+", word)


def test_bounds_are_far_below_the_values():
    """A mistake of a thousandth is never within them."""
    for name in SUITES:
        for group in suite(name):
            for test in group.tests:
                size = np.abs(np.array(test.values, dtype=float)).max()
                assert np.max(test.bound) < 1e-3 * size or size == 0, test.id


def test_a_changed_file_is_against_the_schema():
    path = "import/plain.json"
    table = json.loads(groups()[path])
    del table["group"]["tests"][0]["values"]
    with pytest.raises(ValueError, match="values"):
        read_group(json.dumps(table).encode())


def test_the_page_defines_every_field_and_flag():
    page = files()[PAGE].decode()
    for schema in json.loads(files()["schema/vectors.json"])["$defs"].values():
        if schema["title"] in ("Vector", "Motion", "Group", "Flag", "Frame"):
            for name in schema["properties"]:
                assert f"| `{name}` |" in page
    for flag in FLAGS:
        assert f"| {flag} |" in page


def test_files_are_written_with_checksums(tmp_path):
    assert write_golden(tmp_path, ["evaluation"]) == len(list(tmp_path.rglob("*.*"))) + 1
    done = subprocess.run(
        ["sha256sum", "--check", "--quiet", CHECKSUMS],
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    file = tmp_path / "evaluation" / "bars.json"
    assert hashlib.sha256(file.read_bytes()).hexdigest() in (tmp_path / CHECKSUMS).read_text()
    file.write_bytes(file.read_bytes() + b" ")
    done = subprocess.run(
        ["sha256sum", "--check", CHECKSUMS], cwd=tmp_path, capture_output=True, check=False
    )
    assert done.returncode == 1


def test_bad_targets_and_suites(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises((FileError, OSError)):
        write_golden(tmp_path / "file" / "folder", ["evaluation"])
    with pytest.raises(ParameterError, match="suite must be one of import, evaluation, motion"):
        golden_files(["imports"])
