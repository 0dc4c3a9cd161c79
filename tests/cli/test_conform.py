"""The commands `twolink conform` and `twolink golden`: tables, causes, files, exit codes."""

import json
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from twolink.cli import app


def run(*arguments):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture(scope="module")
def agreement(tmp_path_factory):
    """Pinocchio on the evaluation suite."""
    folder = tmp_path_factory.mktemp("conform")
    files = folder / "report.json", folder / "report.xml"
    found = run(
        *("conform", "pinocchio", "--suite", "evaluation"),
        *("--json", str(files[0]), "--junit", str(files[1])),
    )
    return found, *files


def test_an_engine_that_agrees(agreement):
    found, as_json, as_xml = agreement
    assert found.exit_code == 0, found.output
    lines = found.output.splitlines()
    assert lines[0].startswith("Pinocchio 4")
    assert lines[-1] == "Pinocchio agrees in all 80 tests."
    assert json.loads(as_json.read_text())["agrees"] is True
    assert ElementTree.parse(as_xml).getroot().find("testsuite").attrib["failures"] == "0"


def test_the_table_fits_80_columns(agreement):
    assert max(map(len, agreement[0].output.splitlines())) <= 80


@pytest.mark.slow
def test_an_engine_that_disagrees():
    found = run("conform", "tests.conformance.wrong:GravitySign", "--suite", "evaluation")
    assert found.exit_code == 1
    text = found.output
    assert "gravity acts in the opposite direction (gravity-sign, " in text
    assert "evaluation/bars/gravity-terms" in text
    assert text.splitlines()[-1].startswith("gravity-sign disagrees in ")


@pytest.mark.slow
def test_printed_warnings_are_reported():
    found = run("conform", "tests.conformance.arm:Muttering", "--suite", "evaluation")
    assert found.exit_code == 0, found.output
    said = r"arm printed 11 warnings to its standard error; the first: [warning] \x1b[31mno licence"
    assert said in found.output.splitlines()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("pinnochio",), "did you mean 'Pinocchio'"),
        (("pinocchio", "--suite", "imports"), "suite must be one of import, evaluation, motion"),
        (("pinocchio", "--seconds", "0"), "--seconds must be a positive number; got 0"),
        (("pinocchio", "--memory", "nan"), "--memory must be a positive number of GB; got nan"),
        (("pinocchio", "--json", "/no/such/folder/x.json"), "--json: /no/such/folder/x.json"),
        (("cmd: false",), "the engine does not start: crash: exit code 1"),
        (("cmd: /no/such/program",), "there is no such command"),
        ((), "ENGINE is missing"),
        *(
            (
                ("no:Engine", "--check-harness", option, value),
                f"{option} must be left out with --check-harness; got both",
            )
            for option, value in (
                ("--suite", "motion"),
                ("--json", "a.json"),
                ("--junit", "a.xml"),
                ("--plot", "a.svg"),
                ("--expect", "none.toml"),
            )
        ),
    ],
)
def test_bad_input_is_refused_in_one_sentence(arguments, sentence):
    found = run("conform", *arguments)
    assert found.exit_code == 2
    assert sentence in found.output
    assert len(found.output.strip().splitlines()) == 1


def test_reports_do_not_replace_each_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = run("conform", "pinocchio", "--json", "a.xml", "--junit", str(tmp_path / "a.xml"))
    assert found.exit_code == 2
    path = tmp_path / "a.xml"
    assert found.stderr == f"twolink: --junit must be another file than --json; got {path}\n"


def test_golden_writes_the_vectors(tmp_path):
    found = run("golden", "--out", str(tmp_path / "golden"), "--suite", "evaluation")
    assert found.exit_code == 0, found.output
    assert (tmp_path / "golden" / "evaluation" / "bars.json").exists()
    assert found.output.strip().endswith("files")


def test_golden_refuses_a_folder_that_it_cannot_make(tmp_path):
    (tmp_path / "file").write_text("")
    found = run("golden", "--out", str(tmp_path / "file" / "golden"))
    assert found.exit_code == 2
    assert "--out must be a folder" in found.output


@pytest.mark.slow
def test_the_convergence_of_motions_is_plotted(tmp_path):
    file = tmp_path / "motions.svg"
    found = run(
        *("conform", "tests.conformance.mover:Mover", "--suite", "motion"), "--plot", str(file)
    )
    assert file.exists(), found.output
    text = file.read_text(encoding="utf-8")
    assert "general, fixed steps" in text
    assert "largest error (rad, rad/s)" in text


@pytest.mark.slow
def test_an_engine_without_motions_has_no_plot(tmp_path):
    file = tmp_path / "motions.svg"
    found = run("conform", "tests.conformance.arm:Arm", "--suite", "motion", "--plot", str(file))
    assert not file.exists()
    assert "is not written: there is no motion to plot." in " ".join(found.output.split())


def test_a_plot_of_another_kind_is_refused(tmp_path):
    found = run("conform", "pinocchio", "--plot", str(tmp_path / "motions.gif"))
    assert found.exit_code == 2
    assert "--plot must be a .svg or .png or .pdf file" in found.output
