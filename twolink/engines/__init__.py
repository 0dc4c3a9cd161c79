"""Adapters for external dynamics engines: one protocol, one engine per file."""

from twolink.engines.protocol import Engine

__all__ = ["Engine"]
