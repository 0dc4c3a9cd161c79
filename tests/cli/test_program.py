"""The program as a whole: one sentence and an exit code, whatever happens."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from textwrap import indent
from types import SimpleNamespace

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from twolink import cli, files
from twolink.cli import app
from twolink.cli.program import _ended_by_signals, usage_sentence
from twolink.data import data_path
from twolink.errors import BrowserError, FileError, IntegrationError, ParameterError

FREE_FALL = data_path("scenes") / "free_fall.toml"


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def started(*words, **options):
    return subprocess.Popen(
        [sys.executable, "-m", "twolink.cli", *map(str, words)],
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["verify", "--states", "many"], "--states must be a whole number; got 'many'"),
        (["simulate", "a", "--accuracy=x"], "--accuracy must be a number; got 'x'"),
        (
            ["verify", "--formulation", "kan"],
            "--formulation must be one of kane, lagrange; got 'kan' (did you mean 'kane'?)",
        ),
        (["simulate"], "SCENE is missing; see `twolink simulate --help`"),
        (["simulate", "--accuracy"], "Option '--accuracy' requires an argument"),
        (["verify", "a"], "Got unexpected extra argument"),
        (["verify", "--state", "3"], "got '--state' (did you mean '--states'"),
        (["verfy"], "got 'verfy' (did you mean 'verify'?)"),
        (["--verion"], "one of --version, --help; got '--verion' (did you mean '--version'?)"),
        (["urdf"], "`twolink urdf` must have a command, one of show, repair, write, convert; see"),
        (["urdf", "shw"], "the command must be one of show, repair, write, convert; got 'shw'"),
        (["\x1b[2J"], "got '\\x1b[2J'"),
        (["hardcases", "--case", "zen"], "case must be one of zeno, zeno-slow; got 'zen'"),
        (["hardcases", "--case", "q" * 4000], "(91 in all)"),
        (["hardcases", "--engine", "kana"], "(did you mean 'kane'?)"),
        (["simulate", "no\x1b[31m\nsuch"], "no\\x1b[31m\\nsuch: there is no file of this name"),
        (["simulate", "x" * 300], ": is a name that is too long"),
        (["simulate", "/dev/zero"], "/dev/zero: must be a regular file; got a device"),
        (["verify", "--urdf", "/dev/zero"], "/dev/zero: must be a regular file; got a device"),
        (["plot", FREE_FALL, "--out", "a.svg", "--kind", "angels"], "(did you mean 'angles'?)"),
        (
            ["plot", "a.npz", "--kind", "angles", "--out", "a.svg", "--samples", "-1"],
            "--samples must",
        ),
        (["reference", FREE_FALL, "--out", "x" * 300 + ".csv"], "is a name that is too long"),
        (["record", FREE_FALL, "--out", "a.html", "--ghost", "x" * 300], "--ghost, unless it is"),
        (["simulate", FREE_FALL, "--out", "x" * 300 + ".csv"], "is a name that is too long"),
        (
            ["verify", "--json", "/dev/null"],
            "must be a regular file, or a new one; got a device",
        ),
        (["verify", "--json", "/proc/x.json"], "/proc/x.json: cannot be written"),
    ],
)
def test_a_refusal_is_one_short_sentence(words, sentence):
    result = run(*words)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert result.stderr.startswith("twolink: ")
    assert result.stderr.count("\n") == 1
    assert len(result.stderr) < 700
    assert "\x1b" not in result.stderr
    assert result.stdout == ""


def test_an_argument_is_named_by_its_value():
    """Files that cannot be read: root reads all."""
    scene = SimpleNamespace(opts=["scene"], metavar="SCENE")
    message = "Path 'secret.toml' is not readable."
    error = SimpleNamespace(param=scene, message=message, format_message=lambda: message)
    sentence = usage_sentence(error, ["simulate", "secret.toml"])
    assert sentence == "SCENE is 'secret.toml': Path 'secret.toml' is not readable."


def test_the_program_without_arguments_lists_the_commands():
    assert run().exit_code == 0
    assert "Commands:" in run().stdout


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (IntegrationError("it failed"), 1, "it failed"),
        (BrowserError("it failed"), 1, "it failed"),
        (FileError("a: cannot be written (full)"), 1, "a: cannot be written (full)"),
        (ParameterError("q must be 1; got 2"), 2, "q must be 1; got 2"),
        (MemoryError(), 1, "there is not enough memory (none is left)"),
        (MemoryError("needs 7 TiB"), 1, "there is not enough memory (needs 7 TiB)"),
        (OSError(28, "No space left on device", "b"), 1, "b: No space left on device"),
        (KeyboardInterrupt(), 130, None),
    ],
)
def test_every_error_has_an_exit_code(error, code, words, monkeypatch):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr(sys.modules["twolink.cli.simulate"], "check_target", fails)
    result = run("simulate", FREE_FALL)
    assert result.exit_code == code
    assert result.stderr == (f"twolink: {words}\n" if words else "")


def test_a_bug_of_the_program_raises_its_exception(monkeypatch):
    def fails(*_, **__):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(sys.modules["twolink.cli.simulate"], "check_target", fails)
    assert isinstance(run("simulate", FREE_FALL).exception, ZeroDivisionError)


def test_a_command_in_a_process_leaves_the_temporary_files_of_its_other_work(tmp_path):
    """Such as the folder of a browser that another thread drives, or a file of a notebook."""
    with (
        files.scratch_folder("profile", tmp_path) as folder,
        files.atomic_write(tmp_path / "a") as file,
    ):
        assert run("scenes").exit_code == 0
        assert run("simulate", "no-such").exit_code == 2
        assert folder.exists()
        assert file.exists()


@pytest.mark.parametrize(("end", "code"), [(SystemExit(143), 143), (KeyboardInterrupt(), 130)])
def test_the_program_removes_interrupted_files_before_its_process_ends(end, code, monkeypatch):
    """It may end by `os._exit`, where the interpreter's functions at exit are not called."""
    calls = []

    def ended():
        raise end

    monkeypatch.setattr(cli, "_run", ended)
    monkeypatch.setattr(cli, "remove_interrupted", lambda: calls.append("removed"))
    monkeypatch.setattr(cli, "end_process", calls.append)
    cli.main()
    assert calls == ["removed", code]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("words", [["scenes"], ["verify", "--states", "20"]], ids=" ".join)
def test_a_full_standard_output_is_one_sentence(words):
    with Path("/dev/full").open("w") as full:
        process = started(*words, stdout=full)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert said == ("twolink: the standard output cannot be written to (No space left on device)\n")


def test_a_closed_standard_output_is_one_sentence():
    theirs, ours = os.pipe()
    os.close(theirs)
    process = started("scenes", stdout=ours)
    os.close(ours)
    _, said = process.communicate(timeout=60)
    assert (process.returncode, said) == (
        1,
        "twolink: the standard output cannot be written to (Broken pipe)\n",
    )


@pytest.mark.parametrize("closed", ["stdout", "stderr", "stdin", "both"])
def test_streams_that_are_closed_are_not_taken_for_files(closed, tmp_path):
    """The next file that is opened would get the number of the standard output."""
    file = tmp_path / "verdict.json"
    shut = {"stdout": ">&-", "stderr": "2>&-", "stdin": "<&-", "both": ">&- 2>&-"}[closed]
    command = f'"{sys.executable}" -m twolink.cli verify --states 20 --json "{file}" {shut}'
    run = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    if closed in ("stdout", "both"):
        assert run.returncode == 1
        assert not file.exists()
        if closed == "stdout":
            assert run.stderr == "twolink: the standard output is closed\n"
    else:
        assert run.returncode == 0
        assert file.read_text().startswith("{")
    assert "Traceback" not in run.stderr


@pytest.fixture
def _hangups_end_programs():
    """Programs started by `nohup` ignore hangups, and so do their children."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.usefixtures("_hangups_end_programs")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_that_a_library_turns_into_an_error_ends_the_program(number):
    def turned():
        try:
            os.kill(os.getpid(), number)
        except SystemExit as error:
            raise ValueError("the model could not be built") from error

    with pytest.raises(SystemExit) as ended, _ended_by_signals():
        turned()
    assert ended.value.code == 128 + number


def ended(program):
    """Run Python code in a process of its own, and return how it ended."""
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, check=False, text=True, timeout=20
    )


@pytest.mark.parametrize("rest", ["time.sleep(30)", "pass"])
def test_a_signal_that_is_lost_in_a_library_ends_the_program(rest):
    """Python reports exceptions of destructors and of some C code, and continues."""
    program = (
        "import os, signal, time\n"
        "from twolink.cli.program import _ended_by_signals\n"
        "class Lost:\n"
        "    def __del__(self):\n"
        "        os.kill(os.getpid(), signal.SIGTERM)\n"
        "with _ended_by_signals():\n"
        "    Lost()\n"
        f"    {rest}\n"
        "print('alive')\n"
    )
    run = ended(program)
    assert (run.returncode, run.stdout, run.stderr) == (143, "", "")


@pytest.mark.parametrize("wrong", ["", "        raise ValueError('of its own')\n"])
def test_a_signal_that_comes_while_an_exception_is_reported_ends_the_program(wrong):
    """The hook that reports exceptions of destructors would lose it as they do."""
    program = (
        "import os, signal, sys, time\n"
        "from twolink.cli import program\n"
        "class Struck(program._Signals):\n"
        "    def unraisable(self, lost):\n"
        "        self.report = lambda lost: os.kill(os.getpid(), signal.SIGTERM)\n"
        "        super().unraisable(lost)\n"
        "    def _watch(self):\n"
        "        os.kill(os.getpid(), signal.SIGTERM)\n"
        "        super()._watch()\n"
        "program._Signals = Struck\n"
        "class Lost:\n"
        "    def __del__(self):\n"
        f"{wrong}"
        "        os.kill(os.getpid(), signal.SIGTERM)\n"
        "with program._ended_by_signals():\n"
        "    Lost()\n"
        "    time.sleep(30)\n"
        "print('alive')\n"
    )
    run = ended(program)
    assert (run.returncode, run.stdout) == (143, "")


STRUCK = "import os, signal\nos.kill(os.getpid(), signal.SIGTERM)\nprint('imported', flush=True)\n"


def ended_with(modules, body, folder):
    """Return how a program ends that may import some modules, by their names, from a folder."""
    for name, text in modules.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    return ended(
        "import sys, time\n"
        "from twolink.cli.program import _ended_by_signals\n"
        f"sys.path.insert(0, {str(folder)!r})\n"
        "with _ended_by_signals():\n"
        f"{indent(body, '    ')}\n"
        "print('alive')\n"
    )


CAUGHT = "try:\n    import optional\nexcept BaseException:\n    pass\n"


@pytest.mark.parametrize("rest", ["time.sleep(30)", "pass"])
@pytest.mark.parametrize("later", ["time.sleep(30)", "pass"])
def test_a_signal_that_an_import_would_catch_ends_the_program(later, rest, tmp_path):
    """Libraries import optional ones, and continue after any exception."""
    modules = {"optional": STRUCK, "library": f"import time\n{CAUGHT}{later}\n"}
    run = ended_with(modules, f"import library\n{rest}", tmp_path)
    assert (run.returncode, run.stdout, run.stderr) == (143, "imported\n", "")


@pytest.mark.parametrize("rest", ["time.sleep(30)", "pass"])
@pytest.mark.parametrize("path", ["import", "search"])
def test_a_signal_that_is_caught_outside_of_all_modules_ends_the_program(path, rest, tmp_path):
    """The module that is imported, or still looked for, is lost with the exception."""
    search = (
        "class Finder:\n"
        "    def find_spec(self, *given):\n"
        "        if given[0] == 'optional':\n"
        "            import os, signal\n"
        "            os.kill(os.getpid(), signal.SIGTERM)\n"
        "sys.meta_path.insert(0, Finder())\n"
    )
    body = f"{CAUGHT}{rest}" if path == "import" else f"{search}{CAUGHT}{rest}"
    text = STRUCK if path == "import" else "print('imported', flush=True)\n"
    run = ended_with({"optional": text}, body, tmp_path)
    assert (run.returncode, run.stdout, run.stderr) == (143, "imported\n", "")


@pytest.mark.parametrize("body", ["import optional", f"{CAUGHT}time.sleep(30)"])
def test_a_module_that_never_ends_is_interrupted(body, tmp_path):
    """The exception that ends it may be lost as well."""
    text = f"{STRUCK}import time\ntime.sleep(30)\n"
    run = ended_with({"optional": text}, body, tmp_path)
    assert (run.returncode, run.stdout, run.stderr) == (143, "imported\n", "")


def test_a_signal_that_was_raised_is_not_sent_again(tmp_path):
    """The end of the work is not interrupted."""
    body = (
        "try:\n"
        "    import struck\n"
        "    time.sleep(30)\n"
        "finally:\n"
        "    time.sleep(0.3)\n"
        "    print('put away')"
    )
    run = ended_with({"struck": STRUCK}, body, tmp_path)
    assert (run.returncode, run.stdout, run.stderr) == (143, "imported\nput away\n", "")


def test_other_errors_of_destructors_are_reported():
    program = (
        "from twolink.cli.program import _ended_by_signals\n"
        "class Wrong:\n"
        "    def __del__(self):\n"
        "        raise ValueError('of its own')\n"
        "with _ended_by_signals():\n"
        "    Wrong()\n"
    )
    run = ended(program)
    assert run.returncode == 0
    assert "ValueError: of its own" in run.stderr


def test_an_error_without_a_signal_is_raised_unchanged():
    with pytest.raises(ValueError, match="of its own"), _ended_by_signals():
        raise ValueError("of its own")


@pytest.mark.usefixtures("_hangups_end_programs")
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_signals_end_a_command_cleanly(number, code, tmp_path):
    file = tmp_path / "verdict.json"
    # A pipe that opens once the work has begun: the file's name is known to be writable then. The
    # sleeps are short: Python 3.14 does not look for a signal between two calls of built-ins.
    program = (
        "import os, signal, time\n"
        "from twolink.cli import app, verify\n"
        "def slow(*_):\n"
        "    print('working', flush=True)\n"
        "    end = time.monotonic() + 30\n"
        "    while time.monotonic() < end: time.sleep(0.01)\n"
        "verify._verdict = slow\n"
        f"app(['verify', '--json', {str(file)!r}])\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "working\n"
    process.send_signal(number)
    _, said = process.communicate(timeout=20)
    assert (process.returncode, said) == (code, "")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_before_a_command_begins_is_clean(monkeypatch):
    from twolink import cli

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "app_of", interrupted)
    with pytest.raises(SystemExit) as caught:
        cli.main()
    assert caught.value.code == 130


def test_an_ignored_signal_stays_ignored():
    program = (
        "import os, signal\n"
        "signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from twolink.cli.program import _ended_by_signals\n"
        "with _ended_by_signals():\n"
        "    os.kill(os.getpid(), signal.SIGHUP)\n"
        "print('alive')\n"
    )
    run = ended(program)
    assert (run.returncode, run.stdout) == (0, "alive\n")


@pytest.mark.slow
def test_a_command_imports_no_other():
    program = (
        "import sys\n"
        "from twolink import cli\n"
        "sys.argv = ['twolink', 'scenes']\n"
        "code = cli._exit_code()\n"
        "others = [name for name in (*cli.COMMANDS, *cli.GROUPS) if name != 'scenes']\n"
        "print(code, [name for name in others if f'twolink.cli.{name}' in sys.modules])\n"
    )
    assert ended(program).stdout.splitlines()[-1] == "0 []"


def test_the_program_has_all_commands():
    group = get_command(cli.app)
    assert list(group.commands) == [*cli.COMMANDS, *cli.GROUPS]
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        cli.nothing  # noqa: B018


def test_numbers_near_the_limits_of_float64_leave_one_sentence(tmp_path):
    """NumPy's warnings of overflow were printed before it."""
    file = tmp_path / "drag.toml"
    file.write_text(
        "[chain]\nmass = [1.0, 1.0]\nlength = [1.0, 1.0]\n[start]\nq = [0.0, 0.0]\n"
        "u = [0.3, -0.4]\n[run]\nduration = 0.1\n[effects.compliant_surface]\npoint = [-2.4, 4.0]\n"
        'normal = [-1e31, -3.0]\nlaw = "kelvin-voigt"\nstiffness = 3.0\nloss = 0.8\n'
        "friction = 0.3\n[effects.end_drag]\ncoefficient = 1.7976931348623157e+308\n"
    )
    ended = subprocess.run(
        [sys.executable, "-m", "twolink", "simulate", str(file)],
        check=False,
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 1
    assert ended.stderr.startswith("twolink: ")
    assert ended.stderr.count("\n") == 1
