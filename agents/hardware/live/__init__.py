"""A live swarm that is listened to: what `relpos live` does."""

from agents.hardware.live.result import LiveResult
from agents.hardware.live.run import live

__all__ = ["LiveResult", "live"]
