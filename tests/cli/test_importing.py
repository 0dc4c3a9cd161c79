"""Imports of a command: no side effects of libraries, and none on other programs."""

import gc
import json
import os
import subprocess
import sys
import threading

import pytest

from twolink import cli
from twolink.cli.importing import begin_command, imported_meanwhile, importing
from twolink.data import data_path

FREE_FALL = data_path("scenes") / "free_fall.toml"
NAMES = ("OPENBLAS_NUM_THREADS", "PYDANTIC_DISABLE_PLUGINS")


def found(program, **environment):
    """Return the JSON document that a program prints in a process without the variables."""
    kept = {name: value for name, value in os.environ.items() if name not in NAMES}
    run = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        env={**kept, **environment},
    )
    return json.loads(run.stdout.splitlines()[-1])


INSIDE = (
    "import gc, json, os\n"
    "from twolink.cli import importing\n"
    f"names = {NAMES!r}\n"
    "states = []\n"
    "def note():\n"
    "    states.append([gc.isenabled(), *map(os.environ.get, names)])\n"
    "with importing.own_process():\n"
    "    note()\n"
    "    importing.begin_command()\n"
    "    note()\n"
    "    try:\n"
    "        with importing.importing():\n"
    "            note()\n"
    "            raise ValueError\n"
    "    except ValueError:\n"
    "        note()\n"
    "print(json.dumps([states, gc.get_freeze_count() > 1000]))\n"
)


def test_garbage_and_environment_are_as_before_after_imports():
    states, frozen = found(INSIDE)
    starting, before, within, after = states
    assert starting == [False, None, None]
    assert before == after == [True, None, None]
    assert within == [False, "1", "1"]
    assert frozen


def test_the_environment_of_the_user_counts():
    (_, _, within, after), _ = found(INSIDE, OPENBLAS_NUM_THREADS="2")
    assert within == [False, "2", "1"]
    assert after == [True, "2", None]


def test_a_command_in_another_program_leaves_its_garbage_and_environment(monkeypatch):
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)
    frozen = gc.get_freeze_count()
    # A freeze would count these as well; a frozen object that dies meanwhile counts no more.
    young = [[] for _ in range(1000)]
    begin_command()
    with importing():
        assert gc.isenabled()
        assert not set(NAMES) & set(os.environ)
    assert frozen - len(young) < gc.get_freeze_count() <= frozen


@pytest.mark.slow
def test_simulate_starts_no_threads_of_blas_and_collects_garbage_when_it_runs():
    program = (
        "import gc, json, os, sys\n"
        "from twolink import cli\n"
        "from twolink.cli import simulate\n"
        "seen = []\n"
        "def simulated(*given, run=simulate.simulated):\n"
        "    threads = [open(f'/proc/self/task/{t}/comm').read().strip()\n"
        "               for t in os.listdir('/proc/self/task')]\n"
        "    seen.extend([gc.isenabled(), 'heyoka' in sys.modules, len(threads)])\n"
        "    return run(*given)\n"
        "simulate.simulated = simulated\n"
        "simulate.imported_meanwhile = lambda *modules: __import__('contextlib').nullcontext()\n"
        f"sys.argv = ['twolink', 'simulate', {str(FREE_FALL)!r}]\n"
        "cli.end_process = lambda code: print(json.dumps([code, *seen]))\n"
        "cli.main()\n"
    )
    assert found(program) == [0, True, True, 1]


@pytest.mark.slow
def test_garbage_is_collected_from_the_beginning_of_every_command():
    program = (
        "import gc, json, sys\n"
        "from twolink import cli\n"
        "sys.argv = ['twolink', 'scenes']\n"
        "cli.end_process = lambda code: print(json.dumps([code, gc.isenabled()]))\n"
        "cli.main()\n"
    )
    assert found(program) == [0, True]


def test_the_program_leaves_nothing_changed_where_its_process_goes_on(monkeypatch):
    monkeypatch.setattr(cli, "_run", lambda: None)
    with pytest.raises(SystemExit):
        cli.main()
    assert gc.isenabled()
    test_a_command_in_another_program_leaves_its_garbage_and_environment(monkeypatch)


def test_modules_are_imported_during_the_block():
    program = (
        "import json, sys\n"
        "from twolink.cli.importing import imported_meanwhile\n"
        "with imported_meanwhile('twolink_has_no_such_module', 'colorsys'), \\\n"
        "     imported_meanwhile('sched'):\n"
        "    pass\n"
        "print(json.dumps([name in sys.modules for name in ('colorsys', 'sched')]))\n"
    )
    # What follows a module that fails is imported when it is needed.
    assert found(program) == [False, True]


def test_an_interrupt_does_not_wait_for_imports_that_wait_without_end():
    """An import that was interrupted leaves its module locked (CPython)."""
    program = (
        "import sys, threading\n"
        "from twolink.cli import importing\n"
        "from twolink.interruptible import end_process\n"
        "importing.import_module = lambda name: threading.Event().wait()\n"
        "try:\n"
        "    with importing.imported_meanwhile('json'):\n"
        "        raise KeyboardInterrupt\n"
        "except KeyboardInterrupt:\n"
        "    print(1, flush=True)\n"
        "end_process(0)\n"
    )
    assert found(program) == 1


def test_an_interrupt_during_the_last_wait_for_imports_does_not_abort_the_process():
    """At its end the interpreter would end the thread in compiled code, which aborts."""
    program = (
        "import atexit, os, signal, threading\n"
        "from twolink.cli import importing\n"
        "from twolink.interruptible import end_process\n"
        "importing.import_module = lambda name: threading.Event().wait()\n"
        "importing._PATIENCE = 0.01\n"
        "atexit.register(print, 0)\n"
        "print(1, flush=True)\n"
        "try:\n"
        "    with importing.imported_meanwhile('json'):\n"
        "        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "except KeyboardInterrupt:\n"
        "    end_process(0)\n"
    )
    assert found(program) == 1


def test_no_thread_is_left_by_an_interrupt():
    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt), imported_meanwhile("json"):
        raise KeyboardInterrupt
    assert threading.active_count() == before
