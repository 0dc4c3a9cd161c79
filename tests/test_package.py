"""The public names of the package, and the ways to start its command."""

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import twolink
from twolink import effects, urdf
from twolink.cli import app
from twolink.effects import EFFECTS

ROOT = Path(__file__).parent.parent
VERSION = importlib.metadata.version("twolink")


def test_dir_lists_the_public_names_and_each_of_them_is_there():
    assert set(twolink.__all__) <= set(dir(twolink))
    assert not {"Any", "TYPE_CHECKING", "importlib", "sys"} & set(dir(twolink))
    for name in twolink.__all__:
        assert getattr(twolink, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        twolink.nothing  # noqa: B018


def test_every_effect_is_importable_by_its_class():
    for home, name in EFFECTS.values():
        assert getattr(effects, name) is getattr(importlib.import_module(home), name)
        assert name in effects.__all__
        assert name in dir(effects)
        # Type checkers know it too.
        assert f"    from {home} import {name}\n" in Path(effects.__file__).read_text()
    with pytest.raises(AttributeError, match="has no attribute 'Gravitation'"):
        effects.Gravitation  # noqa: B018


def test_every_public_name_of_urdf_is_importable():
    assert set(urdf.__all__) == set(urdf._HOMES)
    for name, home in urdf._HOMES.items():
        assert getattr(urdf, name) is getattr(importlib.import_module(home), name)
        assert name in dir(urdf)
    with pytest.raises(AttributeError, match="has no attribute 'read_srdf'"):
        urdf.read_srdf  # noqa: B018


def test_the_version():
    assert twolink.__version__ == VERSION
    result = CliRunner().invoke(app, ["--version"])
    assert (result.exit_code, result.output) == (0, f"twolink {VERSION}\n")


def test_the_package_is_a_command():
    done = subprocess.run(
        [sys.executable, "-m", "twolink", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"twolink {VERSION}\n"


def test_the_package_is_marked_as_typed():
    assert (ROOT / "twolink" / "py.typed").read_text() == ""
