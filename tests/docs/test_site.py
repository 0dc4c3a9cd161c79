"""The check of a built site finds each kind of fault."""

import subprocess
import sys

import pytest

from tests.docs.site import faults
from tests.docs.transcript import ROOT


def site(folder, **pages):
    for name, text in pages.items():
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
    return list(faults(folder))


def test_a_site_without_faults(tmp_path):
    (tmp_path / "x.css").write_text("a { background: url('data:image/png;base64,AA') }")
    first = '<link href="x.css"><a href="b.html#here">b</a><a href="https://example.org">out</a>'
    assert site(tmp_path, a=first, b='<p id="here"><a href="#here">up</a><a href=".">top</a>') == [
        "b.html: . leads nowhere"
    ]
    assert site(tmp_path, index="", b='<p id="here"><a href=".">top</a>') == []


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('<a href="nowhere.html">', "a.html: nowhere.html leads nowhere"),
        ('<a href="#nowhere">', "a.html: #nowhere leads nowhere"),
        ('<a href="b.html#no">', "a.html: b.html#no leads nowhere"),
        ('<img src="no.svg">', "a.html: no.svg leads nowhere"),
        (
            '<script src="https://cdn.example.org/x.js">',
            "a.html: loads https://cdn.example.org/x.js",
        ),
        ('<link href="//fonts.example.org/x">', "a.html: loads //fonts.example.org/x"),
    ],
)
def test_a_fault_is_found(tmp_path, text, fault):
    assert site(tmp_path, a=text, b="") == [fault]


def test_a_style_that_loads_from_another_host_is_found(tmp_path):
    (tmp_path / "x.css").write_text('@import "https://example.org/font.css";')
    assert site(tmp_path, a="") == ["x.css: loads https://example.org/font.css"]


def test_faults_have_exit_code_1(tmp_path):
    command = [sys.executable, "-m", "tests.docs.site", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stdout.splitlines() == [f"{tmp_path}: there is no page", "1 faults"]


def test_the_build_is_part_of_the_whole_build():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "sphinx-build -W" in script
    assert "tests.docs.site" in script
