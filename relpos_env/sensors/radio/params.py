"""What the simulated radios do, apart from what the place does to their messages."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from relpos_env.sensors.radio.channel import CALIBRATED, ChannelParams
from tracking.ranging.frames.wire import entries_per_frame
from tracking.ranging.params import SessionParams


@dataclass(frozen=True, slots=True, kw_only=True)
class RadioSimParams:
    """What the simulated radios do."""

    session: SessionParams = field(default_factory=SessionParams)
    """The protocol that they run, and its radio setting."""
    channel: ChannelParams = field(default=CALIBRATED)
    """The place."""
    clock_offset: float = 10e-6
    """[1] Standard deviation of a clock's rate, cut at 20 ppm."""
    clock_wander: float = 5e-10
    """[1] Standard deviation of the change of its rate in a second."""
    antenna_delay_std: float = 0.0
    """[m] What the antenna of each node adds to all its ranges; calibrated away by default."""
    capture: float = 8.0
    """[dB] A message survives another one that is weaker by so much."""
    antenna_height: float = 0.12
    """[m] Of the antenna over the tracker; the same on every car."""

    def for_nodes(self, n_nodes: int) -> RadioSimParams:
        """The same, with the long frames of the radio where a table needs them."""
        phy = self.session.phy
        if n_nodes - 1 <= entries_per_frame(phy.max_frame):
            return self
        return replace(self, session=replace(self.session, phy=replace(phy, max_frame=1023)))
