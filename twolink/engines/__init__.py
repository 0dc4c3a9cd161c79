"""Adapters for external dynamics engines: one contract, one engine per file."""

from twolink.engines.contract import Engine

__all__ = ["Engine"]
