"""Every code block of the documentation runs, and prints the output that its page shows."""

import os
import sys

import pytest

from tests.docs.transcript import ROOT, blocks, follow

FOLDER = ROOT / "docs"
# Followed by tests/test_check_your_engine.py, with its own modules and a C compiler.
ELSEWHERE = {"check_your_engine"}
# Languages that are drawings, or messages without a program.
NOT_CODE = {"text", ""}
ENGINES = {"engines_compared"}


def has_code(page):
    return any(block.language not in NOT_CODE for block in blocks(page.read_text(encoding="utf-8")))


PAGES = [
    pytest.param(page, id=page.stem, marks=pytest.mark.engines if page.stem in ENGINES else ())
    for page in sorted(FOLDER.glob("*.md"))
    if has_code(page) and page.stem not in ELSEWHERE
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return an empty folder with the models of a clone, as the current one."""
    (tmp_path / "models").symlink_to(ROOT / "models")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    known = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - known:
        # Modules that a page has written are gone with its folder.
        file = getattr(sys.modules[name], "__file__", None)
        if file and file.startswith(str(tmp_path) + os.sep):
            del sys.modules[name]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_a_page_word_for_word(page, folder):
    for output in follow(page.read_text(encoding="utf-8"), folder):
        if output.shown:
            assert output.agrees, (
                f"{page.name}, line {output.line}: {output.source}\n\nprints\n\n"
                + "\n".join(output.printed)
            )


def test_every_block_has_a_language_that_is_known():
    languages = {
        block.language
        for page in FOLDER.glob("*.md")
        for block in blocks(page.read_text(encoding="utf-8"))
    }
    assert languages <= {"console", "python", "toml"} | NOT_CODE


def test_every_page_with_code_is_followed():
    assert {page.values[0].stem for page in PAGES} >= {"tutorial", "write_an_effect"}
    assert all((FOLDER / f"{name}.md").exists() for name in ELSEWHERE | ENGINES)
