"""Other people's dynamics behind one protocol, one engine a file."""

from twolink.engines.protocol import Engine

__all__ = ["Engine"]
