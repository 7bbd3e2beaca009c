"""Parameters of a node in the protocol."""

from __future__ import annotations

from dataclasses import dataclass, field

from tracking.errors import ConfigError
from tracking.ranging.exchange import ExchangeParams
from tracking.ranging.frames.airtime import PAPER_PHY, Phy


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionParams:
    """Parameters shared by all nodes of a group, and the antenna delay of one."""

    phy: Phy = field(default=PAPER_PHY)
    """Radio setting, equal in the whole group."""
    pan: int = 0
    """Group number; frames of other groups are ignored."""
    succession: bool = True
    """The next ID takes over from a silent initiator; False: only the watchdog, as in the paper."""
    takeover: float = 2.0
    """[messages] Silence before a takeover, in message times per position in the succession."""
    watchdog: float = 0.6
    """[s] Silence after which a node is reset."""
    listen: tuple[float, float] = (0.04, 0.06)
    """[s] Limits of the time for which a node listens after power-on before it transmits."""
    idle: tuple[float, float] = (0.005, 0.02)
    """[s] Limits of the pause of an initiator without members, drawn every time."""
    drop_after: int = 5
    """[rounds] Silence after which a member is dropped, received by no node."""
    first_check: tuple[float, float] = (0.2, 1.2)
    """[s] Limits of the time after joining at which a responder once leaves out its own slot, and
    listens for another node with its ID."""
    check: tuple[float, float] = (8.0, 12.0)
    """[s] Limits of the time between later checks. For a check an initiator listens for a message
    longer before a request, so that two groups that transmit at the same times lose step."""
    mute: tuple[float, float] = (1.0, 1.5)
    """[s] Limits of the silence of a node that received its own ID."""
    antenna_delay: int = 0
    """[ticks] Delay from the radio's stamp to the antenna, equal for reception."""
    exchange: ExchangeParams = field(default_factory=ExchangeParams)

    def __post_init__(self) -> None:
        if not 0 <= self.pan <= 0xFFFF:
            raise ConfigError(f"pan: expected 0 to 65535, got {self.pan}")
        for name in ("takeover", "watchdog"):
            value = getattr(self, name)
            if not 0.0 < value <= 5.0:  # differences of stamps are unique up to 8.6 s
                raise ConfigError(f"{name}: expected above 0 and at most 5, got {value}")
        for name in ("listen", "idle", "first_check", "check", "mute"):
            low, high = getattr(self, name)
            most = 1e4 if "check" in name else 5.0  # the others are waits, measured by stamps
            if not 0.0 < low <= high <= most:
                raise ConfigError(
                    f"{name}: expected 0 < low <= high <= {most:g}, got {low}, {high}"
                )
        if self.drop_after < 1:
            raise ConfigError(f"drop_after: expected at least 1, got {self.drop_after}")
        if not isinstance(self.antenna_delay, int):
            raise ConfigError(f"antenna_delay: expected whole ticks, got {self.antenna_delay}")
