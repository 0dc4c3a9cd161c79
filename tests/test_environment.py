"""The load of the machine."""

import os

import pytest

from twolink.environment import Load, load_of_machine


@pytest.mark.parametrize(("average", "busy"), [(0.0, False), (1.0, False), (1.1, True)])
def test_half_a_process_for_each_core_makes_a_machine_busy(average, busy):
    load = Load(average, cores=2)
    assert load.most == 1.0
    assert load.busy is busy
    assert str(load).startswith(f"{average:.2f} on 2 cores")
    assert ("busy" in str(load)) is busy


def test_a_system_may_not_tell_its_load(monkeypatch):
    monkeypatch.setattr(os, "getloadavg", lambda: (0.7, 0.0, 0.0), raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert load_of_machine() == Load(0.7, cores=4)
    monkeypatch.delattr(os, "getloadavg")
    assert load_of_machine() is None
