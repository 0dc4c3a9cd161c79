"""Variations of smooth motions: derivatives by starts and parameters, and Lyapunov exponents.

`sensitivity` integrates a motion together with its derivatives, `uncertainty` spreads the
uncertainty of starts and parameters over time, and `spectrum` measures how fast neighbouring
motions separate.
"""
