"""Recordings tracked again: what `relpos replay` does."""

from agents.replay.result import ReplayResult
from agents.replay.run import replay

__all__ = ["ReplayResult", "replay"]
