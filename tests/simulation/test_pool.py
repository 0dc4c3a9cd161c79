"""Pools of integrators: nothing is lent twice, and nothing is compiled twice."""

import pickle

import heyoka
import numpy as np

from twolink.simulation.pool import IntegratorPool


def falling():
    x, v = heyoka.make_vars("x", "v")
    return heyoka.taylor_adaptive([(x, v), (v, heyoka.expression(9.81))], [0.0, 0.0])


def test_an_integrator_is_lent_once_at_a_time():
    pool = IntegratorPool(falling())
    with pool.lend() as first, pool.lend() as second:
        assert first is not second
        first.propagate_until(1.0)
        assert second.time == pool.original.time == 0.0


def test_an_integrator_that_came_back_is_lent_again():
    pool = IntegratorPool(falling())
    with pool.lend() as first:
        pass
    with pool.lend() as again:
        assert again is first


def test_an_integrator_comes_back_from_a_run_that_fails():
    pool = IntegratorPool(falling())
    lent = []
    for _ in range(2):
        try:
            with pool.lend() as integrator:
                lent.append(integrator)
                raise KeyboardInterrupt
        except KeyboardInterrupt:
            pass
    assert lent[0] is lent[1]


def test_a_pool_can_be_pickled():
    pool = pickle.loads(pickle.dumps(IntegratorPool(falling())))
    with pool.lend() as integrator:
        integrator.propagate_until(1.0)
        assert np.allclose(integrator.state, [9.81 / 2, 9.81], rtol=1e-14)


def test_a_view_of_each_integrator_is_made_once():
    made = []

    def view(integrator):
        made.append(integrator.state)
        return integrator, made[-1]

    pool = IntegratorPool(falling(), view)
    for _ in range(2):
        with pool.lend() as (integrator, state):
            integrator.time = 0.0
            state[:] = 0.0, 2.0
            integrator.propagate_until(1.0)
            assert state[0] == 2.0 + 9.81 / 2
    assert len(made) == 1
