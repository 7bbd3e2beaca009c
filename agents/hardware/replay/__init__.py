"""Recordings tracked again: what `relpos replay` does."""

from agents.hardware.replay.result import ReplayResult
from agents.hardware.replay.run import replay

__all__ = ["ReplayResult", "replay"]
