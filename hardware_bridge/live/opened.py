"""What a drive needs of a bridge, whether ports and a clock are behind it or neither."""

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
    """A feed with a gate at its end."""

    notices: list[tuple[int, str]]
    """Time [ns] and what the user should read; taking them clears the list."""
    n_late: int
    """Decisions that were due while the one before was still made."""
    attend: Callable[[], None] | None
    """Called while waiting, every hundredth of a second or so: for keys and screens."""


class OpenBridge(ABC):
    """Everything of a swarm, opened: over ports and processes, or in memory."""

    config: SwarmConfig
    """Of the swarm."""
    swarm: LiveSwarm
    """Trackers of the cars."""
    feed: OpenFeed
    """Where bytes come from and pictures go to."""
    start: Start
    """What happens before a drive."""

    def env(
        self,
        *,
        observation: str = "estimate",
        history: int = 1,
        actions: str = "continuous",
        max_cycles: int = 600,
    ) -> HardwareFormationEnv:
        """Return the environment on these cars; the last one that was made is the one to use."""
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
        """Why records are missing in the recording; None if none are, or there is none."""
        return None

    @abstractmethod
    def close(self) -> None:
        """Let the cars stand and close everything."""
