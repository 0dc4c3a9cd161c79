"""The pages that are generated from the code have every command, effect, message and scene."""

import json
import sys

import pytest
import typer

from tests.docs.transcript import ROOT
from twolink.cli import app
from twolink.effects import EFFECTS
from twolink.engines import messages


@pytest.fixture(autouse=True)
def extensions(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    yield
    for name in [name for name in sys.modules if name.partition(".")[0] == "extensions"]:
        del sys.modules[name]


def test_every_command_has_a_section_with_its_options():
    from extensions.commands import commands_page

    page = commands_page()
    program = typer.main.get_command(app)
    for name, command in program.commands.items():
        if not hasattr(command, "commands"):
            section = page.partition(f"\n## twolink {name}\n")[2].partition("\n## ")[0]
            assert section
            for parameter in command.params:
                for option in parameter.opts:
                    assert not option.startswith("-") or option in section
    assert "\n## twolink urdf repair\n" in page


def test_every_effect_has_a_section_with_its_keys(tmp_path):
    from extensions.scene_keys import scene_keys_page

    page = scene_keys_page(tmp_path)
    for name in EFFECTS:
        assert f"\n### {name}\n" in page
    assert "| `restitution` | number | `0.0` |" in page
    assert "| `kinetic` | 2 × number | required |" in page
    assert "| `duration` | number | required | s |" in page
    assert json.loads((tmp_path / "scene.schema.json").read_text())["title"] == "Scene"


def test_every_message_has_a_section_and_a_schema(tmp_path):
    from extensions.messages import messages_page

    page = messages_page(tmp_path)
    for name in messages.schemas():
        assert (tmp_path / f"message-{name}.json").exists()
    assert "\n## Start\n" in page
    assert "| `engine` | [About](#about) | yes |" in page
    assert '| `cmd` | `"move"` |  |' in page
    assert "| `angles` | list of 2 of number | yes |" in page


def test_files_are_written_only_if_they_change(tmp_path):
    from extensions.files import write_if_new

    file = tmp_path / "x.md"
    write_if_new(file, "one")
    before = file.stat().st_mtime_ns
    write_if_new(file, "one")
    assert file.stat().st_mtime_ns == before
    write_if_new(file, "two")
    assert file.read_text() == "two"


@pytest.mark.slow
def test_a_scene_of_the_gallery_has_stills_and_a_film(tmp_path):
    from extensions.gallery import _section

    from twolink.scene import scene_names

    section = _section("drop", scene_names()["drop"], tmp_path)
    (film,) = (tmp_path / "site" / "films").iterdir()
    assert f"../films/{film.name}" in section
    assert "<html" in film.read_text(encoding="utf-8")
    for theme in ("light", "dark"):
        assert (tmp_path / f"{film.stem}-{theme}.svg").exists()
    first = film.stat().st_mtime_ns
    assert _section("drop", scene_names()["drop"], tmp_path) == section
    assert film.stat().st_mtime_ns == first
