"""A slow, independent, event-driven integrator that judges the fast simulator in tests.

It shares no code with the simulator: the equations of motion, the laws of friction and contact,
the laws of impact and the search for events are written anew, by other methods.
"""

from tests.judge.integrate import JudgeRun, judge
from tests.judge.modes import JudgeGivesUp, State

__all__ = ["JudgeGivesUp", "JudgeRun", "State", "judge"]
