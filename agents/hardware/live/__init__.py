"""Track a live swarm without driving it (`relpos live`)."""

from agents.hardware.live.result import LiveResult
from agents.hardware.live.run import live

__all__ = ["LiveResult", "live"]
