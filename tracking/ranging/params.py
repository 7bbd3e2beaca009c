"""How a node takes part in the protocol."""

from __future__ import annotations

from dataclasses import dataclass, field

from tracking.errors import ConfigError
from tracking.ranging.exchange import ExchangeParams
from tracking.ranging.frames.airtime import PAPER_PHY, Phy


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionParams:
    """What all nodes of a group agree on, and the antenna of one."""

    phy: Phy = field(default=PAPER_PHY)
    """The same in the whole group."""
    pan: int = 0
    """Group number; frames of other groups are ignored."""
    succession: bool = True
    """The next ID takes over from a silent initiator; False: only the watchdog, as in the paper."""
    takeover: float = 2.0
    """[messages] Silence of so many message times per place in the line of succession."""
    watchdog: float = 0.6
    """[s] A node that hears nothing for so long is reset."""
    listen: tuple[float, float] = (0.04, 0.06)
    """[s] A node that is switched on listens for a time between these before it speaks."""
    idle: tuple[float, float] = (0.005, 0.02)
    """[s] Pause of an initiator that is alone, drawn again every time."""
    drop_after: int = 5
    """[rounds] A member that no node has received for so long is dropped."""
    first_check: tuple[float, float] = (0.2, 1.2)
    """[s] After joining, a responder once keeps silent in its own slot and listens whether
    another one uses its ID; when, is drawn from this interval."""
    check: tuple[float, float] = (8.0, 12.0)
    """[s] Time between the checks after that. An initiator listens for a message longer before
    a request then, so that two groups that speak at the same times come out of step."""
    mute: tuple[float, float] = (1.0, 1.5)
    """[s] Silence of a node that heard its own ID."""
    antenna_delay: int = 0
    """[ticks] From the radio's stamp to the antenna, and the same on the way in."""
    exchange: ExchangeParams = field(default_factory=ExchangeParams)

    def __post_init__(self) -> None:
        if not 0 <= self.pan <= 0xFFFF:
            raise ConfigError(f"pan: expected 0 to 65535, got {self.pan}")
        for name in ("takeover", "watchdog"):
            value = getattr(self, name)
            if not 0.0 < value <= 5.0:  # stamps tell times apart that are within 8.6 s
                raise ConfigError(f"{name}: expected above 0 and at most 5, got {value}")
        for name in ("listen", "idle", "first_check", "check", "mute"):
            low, high = getattr(self, name)
            most = 1e4 if "check" in name else 5.0  # the others are ends of waits, told by stamps
            if not 0.0 < low <= high <= most:
                raise ConfigError(
                    f"{name}: expected 0 < low <= high <= {most:g}, got {low}, {high}"
                )
        if self.drop_after < 1:
            raise ConfigError(f"drop_after: expected at least 1, got {self.drop_after}")
        if not isinstance(self.antenna_delay, int):
            raise ConfigError(f"antenna_delay: expected whole ticks, got {self.antenna_delay}")
