"""Hostile command lines, trajectory files and environments, and the properties of every run.

`python -m tests.fuzz --inputs N --seed S` draws N inputs and runs each in a process of its own. An
input with a fault is marked, and must be refused.
"""
