"""Hostile command lines, trajectory files and environments, and what must hold for all of them.

`python -m tests.fuzz --inputs N --seed S` draws N inputs and runs each in a process of its own. An
input that has something wrong in it knows so, and must be refused.
"""
