"""Warm-up: a simulated drive that loads compiled code before any deadline applies.

Compiled code is loaded from disk at its first call, which takes longer than a car may be without a
command.
"""

from __future__ import annotations

import math

import numpy as np

from hardware_bridge.config.swarm import SwarmConfig
from hardware_bridge.live.group import LiveGroup
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.readings import UNNAMED, PoseReading
from hardware_bridge.safety.picture import Picture
from relpos_env.interface.observations import observation_mode
from relpos_env.timing import DECISION
from tracking.geometry import GRAVITY
from tracking.measurements import Kind

SECONDS = 3.0
"""[s] Duration of the simulated drive, long enough for estimates to begin."""
RATE = 50
"""[1/s] Rate of samples and of ranges."""


class _Pretend:
    """Feed with nodes that drive in circles."""

    def __init__(self, swarm: LiveSwarm) -> None:
        self._swarm, self._k = swarm, 0

    def advance(self) -> int:
        """Add the samples and ranges of one control step."""
        for _ in range(round(DECISION * RATE)):
            self._k += 1
            self._sample(self._k / RATE)
        return round(self._k / RATE * 1e9)

    def decide(self, picture: Picture) -> None:
        """Do nothing, since there is no gate."""

    def _sample(self, t: float) -> None:
        swarm = self._swarm
        events, group, antenna = swarm.intake.events, swarm.group, swarm.intake.antennas
        pos = [np.array([3.0 * k + math.sin(t + k), math.cos(t * (1 + 0.1 * k)), 0.0])
               for k in range(group.n_nodes)]  # fmt: skip
        for k in range(swarm.config.n_slots):
            swarm.intake.received_ns[k] = swarm.intake.sensed_ns[k] = round(t * 1e9)
            events.add(t, Kind.MAG, k, (20.0, 0.0, -40.0))
            events.add(t, Kind.IMU, k, (0.0, 0.0, 0.1, 0.3 * math.sin(t), 0.0, GRAVITY))
            pose = PoseReading(UNNAMED, "", pos=tuple(pos[k]), q_wb=(1.0, 0.0, 0.0, 0.0))
            swarm.intake.other.pending.add_pose(t, k, pose)
        for i, j in group.pairs.tolist():
            distance = float(np.linalg.norm(pos[j] - pos[i]))
            events.add_range(t, (i, j), (antenna[i], antenna[j]), (distance, -80.0, -82.0))


def warm_up(config: SwarmConfig, observation: str = "estimate") -> None:
    """Run all code of a drive once, on a separate swarm.

    Args:
        config: Configuration of the swarm.
        observation: Observation mode of the drive.
    """
    swarm = LiveSwarm(config, 0)
    mode = observation_mode(observation, config.n_slots)
    group = LiveGroup(swarm, _Pretend(swarm), mode)
    group.begin()
    still = np.zeros((1, config.n_slots))
    for _ in range(round(SECONDS / DECISION)):
        group.step(still, still)
