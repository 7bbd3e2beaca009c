"""Interface of a bridge for drives, over ports and a clock or in memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from hardware_bridge.config.swarm import SwarmConfig
from hardware_bridge.live.env import HardwareFormationEnv
from hardware_bridge.live.group import Feed
from hardware_bridge.live.start import Gated, Start
from hardware_bridge.live.swarm import LiveSwarm


class OpenFeed(Feed, Gated, Protocol):
    """A feed with a gate."""

    notices: list[tuple[int, str]]
    """Time [ns] and text of notices to the user; the reader clears the list."""
    n_late: int
    """Number of control steps that were due while the previous one was still running."""
    attend: Callable[[], None] | None
    """Called about every 10 ms while waiting, for keys and screens."""


class OpenBridge(ABC):
    """All parts of an open swarm: over ports and processes, or in memory."""

    config: SwarmConfig
    """Configuration of the swarm."""
    swarm: LiveSwarm
    """Trackers of the cars."""
    feed: OpenFeed
    """Source of bytes and destination of snapshots."""
    start: Start
    """Start-up before a drive."""

    def env(
        self,
        *,
        observation: str = "estimate",
        history: int = 1,
        actions: str = "continuous",
        max_cycles: int = 600,
    ) -> HardwareFormationEnv:
        """Return the environment on these cars; only the latest one may be used."""
        return HardwareFormationEnv(
            self.swarm,
            self.feed,
            observation=observation,
            history=history,
            actions=actions,
            max_cycles=max_cycles,
            prepare=self.start.run,
        )

    @property
    def recording_lost(self) -> str | None:
        """Reason for missing records in the recording; None if it is complete or there is none."""
        return None

    @abstractmethod
    def close(self) -> None:
        """Stop the cars and close everything."""
