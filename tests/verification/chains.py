"""Chains that tests of the verification share."""

from twolink.chain import Chain

# General: no two parameters equal, both mass centres off their axes.
GENERAL = Chain(
    mass=(1.3, 0.7),
    length=(0.9, 1.4),
    centre=((0.35, 0.12), (0.55, -0.21)),
    inertia=(0.11, 0.23),
)
