"""A live swarm that is listened to: what `relpos live` does."""

from agents.live.result import LiveResult
from agents.live.run import live

__all__ = ["LiveResult", "live"]
