"""Integrators of scenes: compiled ahead of use, and found."""

from contextlib import closing
from dataclasses import replace
from threading import get_ident
from time import sleep

import numpy as np
import pytest

from tests.simulation.smooth.test_taylor import SCENE, TIMES
from twolink.effects import Effect
from twolink.effects.gravity import Gravity
from twolink.loads import Torque
from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.memo import Memo
from twolink.simulation.smooth import integrators, taylor
from twolink.simulation.smooth.integrators import compile_ahead
from twolink.simulation.smooth.taylor import taylor_run


def moved(start):
    """Return the scene with another length, so that there is no code for it."""
    return replace(SCENE, chain=replace(SCENE.chain, length=(1.0, start)))


def test_the_code_of_a_run_may_be_compiled_ahead(monkeypatch):
    made = []

    def compile_here(*key):
        made.append((get_ident(), key[4]))
        return compiled(*key)

    compiled = integrators.INTEGRATORS._function
    memo = Memo(compile_here, 8)
    for module in (integrators, taylor):
        monkeypatch.setattr(module, "INTEGRATORS", memo)
    scene = moved(1.25)
    with closing(CompilationThread()) as thread:
        compile_ahead(thread, scene, "momenta", "double", 9)
        compile_ahead(thread, scene, "momenta", "double", 9)
        while not made:
            sleep(0.001)
        found = taylor_run(scene, TIMES, formulation="momenta", order=9, ahead=thread)
        # There is nothing to do for code that is there.
        compile_ahead(thread, scene, "momenta", "double", 9)
    assert [order for _, order in made] == [9]
    assert made[0][0] != get_ident()
    assert np.array_equal(found.q, taylor_run(scene, TIMES, formulation="momenta", order=9).q)


class Changing(Effect):
    """A torque that may be changed between two runs."""

    torque = 1.0

    def loads(self, chain, q, u, t=0.0):
        return (Torque(1, self.torque),)


@pytest.mark.parametrize(("effect", "count"), [(Gravity(), 1), (Changing(), 0)])
def test_code_for_effects_that_may_change_is_not_compiled_ahead(effect, count):
    """It would not be found."""
    requested = []
    thread = CompilationThread()
    thread.request = lambda key, work: requested.append(key)
    scene = replace(moved(1.5), effects=(effect,))
    compile_ahead(thread, scene, "momenta", "double", 9)
    assert len(requested) == count
