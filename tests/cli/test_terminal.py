"""Text from files and command lines neither controls the terminal nor is read as markup."""

import ast
from pathlib import Path

import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.cli.terminal import console, say, styled, write_json
from twolink.data import data_path

HOSTILE = r"[/nope] [bold]a[/] :smile: \u001b[31mred\u0007 <b>&amp;</b> $\\frac $1"
FITTING = r"[/nope] [bold]a[/] :smile: \x1b[31mred\x07 <b>&amp;</b> $\frac $1"
CLI = Path(__file__).parent.parent.parent / "twolink" / "cli"


@pytest.fixture
def scene(tmp_path):
    """A scene whose title and file name are hostile."""
    text = (data_path("scenes") / "free_fall.toml").read_text()
    lines = [f'title = "{HOSTILE}"', *(x for x in text.splitlines() if not x.startswith("title"))]
    file = tmp_path / "[red]\x1b[2J.toml"
    file.write_text("\n".join(lines).replace("duration = 10.0", "duration = 0.5"))
    return file


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_titles_are_printed_as_they_are(scene, tmp_path):
    for words in (["simulate", scene], ["reference", scene, "--digits", "12"]):
        result = run(*words)
        assert result.exit_code == 0, result.output
        assert "[/nope] [bold]a[/] :smile: \\x1b[31mred\\x07" in result.stdout
        assert "\x1b" not in result.output


@pytest.mark.slow
def test_names_of_surfaces_are_printed_and_drawn_as_they_are(scene, tmp_path):
    floor = f'point = [0.0, 0.5]\nnormal = [0.0, -1.0]\nname = "{HOSTILE}"\n'
    scene.write_text(f"{scene.read_text()}\n[effects.surface]\n{floor}")
    result = run("simulate", scene)
    assert result.exit_code == 0, result.output
    assert "D hits [/nope] [bold]a[/] :smile: \\x1b[31mred\\x07" in result.stdout
    assert "\x1b" not in result.output
    for out, *options in ("a.svg", "--kind", "contact"), ("a.html", "--fps", "2"):
        result = run("plot" if options[0] == "--kind" else "record", scene, *options, "--out",
                     tmp_path / out)  # fmt: skip
        assert result.exit_code == 0, result.output
        assert not set("\x1b\x07") & set((tmp_path / out).read_text())


@pytest.mark.slow
def test_titles_in_plots_and_pages(scene, tmp_path):
    out = tmp_path / "all.svg"
    assert run("plot", scene, "--kind", "angles", "--out", out).exit_code == 0
    drawn = out.read_text()
    assert not set("\x1b\x07") & set(drawn)
    # matplotlib keeps the words it draws in comments.
    assert "[31mred\\x07 &lt;b" in drawn or "\\x07 <b>" in drawn
    page = tmp_path / "a.html"
    result = run("record", scene, "--out", page)
    assert result.exit_code == 0, result.output
    assert not set("\x1b\x07") & set(page.read_text())
    assert "<b>&amp;</b>" not in page.read_text().split("<script")[0]


@pytest.mark.slow
def test_file_names_that_are_no_text(tmp_path):
    file = tmp_path / b"bad\xff\x1b.toml".decode(errors="surrogateescape")
    file.write_text((data_path("scenes") / "free_fall.toml").read_text())
    result = run("record", file, "--out", tmp_path / "a.html", "--ghost", "kane", "--fps", "2")
    assert result.exit_code == 0, result.output
    result = run("simulate", f"{file}x")
    assert result.exit_code == 2
    assert "bad\\xff\\x1b.tomlx: there is no file" in result.stderr
    urdf = tmp_path / b"bad\xff.urdf".decode(errors="surrogateescape")
    urdf.write_text(data_path("twolink.urdf").read_text())
    result = run("verify", "--urdf", urdf, "--states", "5", "--json", tmp_path / "v.json")
    assert result.exit_code == 0, result.output
    assert "bad\\xff.urdf in Pinocchio" in result.stdout
    assert "bad\\udcff.urdf" in (tmp_path / "v.json").read_text()


@pytest.mark.parametrize(
    ("words", "name", "target"),
    [
        (["urdf", "convert", "INPUT", "--to", "sdf", "--out", "OUT"], "a.sdf", ""),
        (["urdf", "repair", "INPUT", "--out", "OUT"], "a.urdf", ""),
        (["verify", "--urdf", "INPUT", "--json", "OUT"], "a.urdf", ""),
        (["simulate", "INPUT", "--out", "OUT"], "a.csv", ""),
        (["plot", "INPUT", "--kind", "path", "--out", "OUT"], "a.svg", ""),
        (["plot", "drop", "--with", "INPUT", "--kind", "path", "--out", "OUT"], "a.svg", ""),
        (["record", "INPUT", "--out", "OUT"], "a.html", ""),
        (["record", "drop", "--ghost", "INPUT", "--out", "OUT"], "a.html", ""),
        (["record", "drop", "--urdf", "INPUT", "--out", "OUT"], "a.html", ""),
        (["sensitivity", "INPUT", "--by", "q1", "--out", "OUT"], "a.json", ""),
        (["sweep", "INPUT", "--out", "a.zarr", "--plot", "OUT"], "a.svg", ""),
        (["conform", "mujoco", "--expect", "INPUT", "--json", "OUT"], "a.toml", ""),
        (["conform", "mujoco", "--expect", "INPUT", "--junit", "OUT"], "a.toml", ""),
        (["conform", "mujoco", "--expect", "INPUT", "--plot", "OUT"], "a.svg", ""),
        (["conform", "fmu:INPUT", "--json", "OUT"], "a.fmu", ""),
        (["conform", "cmd: python INPUT", "--junit", "OUT"], "engine.py", ""),
        (["reference", "INPUT", "--out", "OUT"], "a.json", ""),
        (["reference", "drop", "INPUT", "--out", "OUT"], "drop.csv", "."),
        (["accuracy", "INPUT", "--out", "OUT"], "accuracy.png", "."),
        (["drift", "INPUT", "--out", "OUT"], "drift.csv", "."),
        (["report", "INPUT", "--out", "OUT"], "index.html", "."),
        (["scoreboard", "INPUT", "--out", "OUT"], "scoreboard.json", "."),
    ],
    ids=lambda value: value[:2] if isinstance(value, list) else value,
)
def test_no_command_replaces_its_input(words, name, target, tmp_path, monkeypatch):
    """Neither under the name that was given, nor where a link has another."""
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(data_path("twolink.urdf").read_bytes())
    Path("link.toml").symlink_to(name)
    before = Path(name).read_bytes()
    for read in (name, "link.toml"):
        result = run(*(w.replace("INPUT", read).replace("OUT", target or name) for w in words))
        assert (result.exit_code, result.stdout) == (2, "")
        assert f" must not replace the input {read}; got {target or name}\n" in result.stderr
        assert result.stderr.count("\n") == 1
        assert Path(name).read_bytes() == before


def test_no_derived_name_replaces_an_input(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a.toml").write_bytes(data_path("scenes/drop.toml").read_bytes())
    Path("p-path.svg").symlink_to("a.toml")
    result = run("plot", "a.toml", "--kind", "all", "--out", "p.svg")
    assert result.exit_code == 2
    assert result.stderr == "twolink: --out must not replace the input a.toml; got p.svg\n"
    assert Path("p-path.svg").is_symlink()


@pytest.mark.parametrize(
    ("words", "file", "text"),
    [
        (["simulate", "a.toml", "--out", "arm.csv"], "a.toml", '[chain]\nurdf = "arm.csv"'),
        (
            ["sweep", "a.toml", "--out", "a.zarr", "--plot", "arm.svg"],
            "a.toml",
            'scene = "arm.svg"',
        ),
        (
            ["sweep", "a.toml", "--out", "a.zarr", "--plot", "arm.svg"],
            "a.toml",
            '[scene.chain]\nurdf = "arm.svg"',
        ),
    ],
)
def test_no_command_replaces_a_file_that_its_scene_names(words, file, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path(file).write_text(text, encoding="utf-8")
    Path(words[-1]).write_bytes(b"kept = 1")
    result = run(*words)
    assert result.exit_code == 2
    said = f"twolink: {words[-2]} must not replace the input {words[-1]}; got {words[-1]}\n"
    assert result.stderr == said
    assert Path(words[-1]).read_bytes() == b"kept = 1"


def test_the_console_reads_no_markup(capsys):
    from rich.table import Table

    page = console()
    table = Table(title="[bold]title", caption="\x1b[1mcaption")
    table.add_column("[red]head")
    table.add_row("[/nope]\x07:smile:")
    page.print(table)
    page.print(styled(("[b]\x1b", "bold"), "\x9b"), "\x1b]0;window\x07")
    said = capsys.readouterr().out
    for words in ("[bold]title", "\\x1b[1mcaption", "[red]head", "[/nope]\\x07:smile:"):
        assert words in said
    assert "[b]\\x1b\\x9b" in said
    assert not set("\x1b\x07\x9b") & set(said)


def test_say_escapes(capsys):
    say("a\x1bb\nc")
    assert capsys.readouterr().out == "a\\x1bb\nc\n"


def test_json_of_a_lone_surrogate_is_valid(tmp_path):
    import json

    write_json(tmp_path / "a.json", {"name": "\udcff", "x": float("nan")})
    assert json.loads((tmp_path / "a.json").read_bytes()) == {"name": "\udcff", "x": "nan"}


@pytest.mark.parametrize("file", sorted(CLI.glob("*.py")), ids=lambda file: file.stem)
def test_only_the_terminal_s_module_prints(file):
    """All output passes the module that escapes control characters."""
    tree = ast.parse(file.read_text())
    calls = {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    assert file.stem == "terminal" or not calls & {"typer.echo", "print", "Console", "typer.secho"}
