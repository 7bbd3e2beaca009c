"""A group of nodes in the reference radio simulation, and its messages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.errors import UsageError
from relpos_env.sensors.radio.air import Air
from relpos_env.sensors.radio.params import RadioSimParams
from tracking.ranging.frames.airtime import airtime
from tracking.ranging.frames.wire import Frame, decode
from tracking.ranging.params import SessionParams

DT = 0.01
"""[s] Step of the radio simulation."""


@dataclass(frozen=True, slots=True)
class ReceivedMessage:
    """A message as received by an ideal observer."""

    start: float
    """[s] Start of the preamble."""
    end: float
    """[s] End of the message."""
    frame: Frame


class Group:
    """Static nodes in a room of 5 m x 5 m, all in line of sight."""

    def __init__(self, params: RadioSimParams, n_nodes: int, rng: np.random.Generator) -> None:
        self._rng = rng
        self._phy = params.session.phy
        self._pos = rng.uniform(-2.5, 2.5, (n_nodes, 3)) * [1.0, 1.0, 0.1]
        self.air = Air(params, n_nodes, int(rng.integers(1 << 62)), DT)

    @property
    def t(self) -> float:
        """[s] Current time."""
        return self.air.t

    def switch_on(self, node: int, after: float = 0.0) -> None:
        """Switch a node on, after a delay [s]."""
        self.air.switch_on(node, boot=int(self._rng.integers(256)), at=after)

    def run(self, seconds: float) -> None:
        """Advance the simulation by a time [s]."""
        for _ in range(round(seconds / DT)):
            self.air.step(self._pos, self._pos)

    def assemble(self, nodes: range, limit: float) -> None:
        """Run until the members in the session of each given node are exactly the given nodes.

        Raises:
            UsageError: The time limit [s] is exceeded.
        """
        for _ in range(round(limit / DT)):
            self.run(DT)
            sessions = [self.air.sessions[k] for k in nodes]
            if all(s is not None and s.members == tuple(nodes) for s in sessions):
                return
        raise UsageError(f"protocol: {len(nodes)} nodes did not find together in {limit:g} s")

    def listen(self) -> list[ReceivedMessage]:
        """Return the messages since the last call."""
        received = []
        for sent in self.air.sent:
            start = sent.t - self._phy.header_time
            end = start + airtime(self._phy, len(sent.data))
            received.append(ReceivedMessage(start, end, decode(sent.data)))
        self.air.sent.clear()
        return sorted(received, key=lambda h: h.start)


def radio_params(**session: object) -> RadioSimParams:
    """Return the default radio with other settings of the session."""
    return RadioSimParams(session=SessionParams(**session))  # type: ignore[arg-type]
