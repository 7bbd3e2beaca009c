"""Track recordings again (`relpos replay`)."""

from agents.hardware.replay.result import ReplayResult
from agents.hardware.replay.run import replay

__all__ = ["ReplayResult", "replay"]
