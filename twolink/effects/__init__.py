"""Effects: what may act on a chain, one effect a file; scene parameters in, loads out.

An effect is a small frozen object. Its `loads(chain, q, u)` says where on the chain which force
or torque acts in that state; `potential_energy(chain, q)` is there when it has one. An effect
that is not wanted is left out: there is no switch, and nothing to switch off.
"""
