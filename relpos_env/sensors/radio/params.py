"""Parameters of the simulated radios; `channel` has those of the propagation."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from relpos_env.sensors.radio.channel import CALIBRATED, ChannelParams
from tracking.ranging.frames.motion import MOTION_BYTES
from tracking.ranging.params import SessionParams


@dataclass(frozen=True, slots=True, kw_only=True)
class RadioSimParams:
    """Parameters of the simulated radios."""

    session: SessionParams = field(default_factory=SessionParams)
    """Ranging protocol and its radio setting."""
    channel: ChannelParams = field(default=CALIBRATED)
    """Propagation in the radio environment."""
    clock_offset: float = 10e-6
    """[1] Standard deviation of the rate offset of a clock, cut at 20 ppm."""
    clock_wander: float = 5e-10
    """[1] Standard deviation of the change of a clock's rate in a second."""
    antenna_delay_std: float = 0.0
    """[m] Standard deviation of a node's antenna delay; calibrated away by default."""
    capture: float = 8.0
    """[dB] Capture margin: a message survives another one that is weaker by this much."""
    antenna_height: float = 0.12
    """[m] Height of the antenna over the tracker; the same on every car."""

    def with_motion(self) -> RadioSimParams:
        """Return these parameters, with preintegrated motion in the messages."""
        phy = replace(self.session.phy, motion_bytes=MOTION_BYTES)
        return replace(self, session=replace(self.session, phy=phy))

    def for_nodes(self, n_nodes: int) -> RadioSimParams:
        """Return these parameters, with long radio frames if the table of `n_nodes` needs them."""
        phy = self.session.phy
        if n_nodes - 1 <= phy.room:
            return self
        return replace(self, session=replace(self.session, phy=replace(phy, max_frame=1023)))
