"""Synthetic groups with measurements for timing, the same for the tracker and its peers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from tracking.arrays import F64, I64
from tracking.constellation import Constellation, NodeConfig
from tracking.geometry import quat_from_yaw
from tracking.measurements import Kind, MeasurementBlock
from tracking.ranging.frames.airtime import PAPER_PHY, round_rate

RANGE_STD = 0.05
"""[m] Standard deviation of ranges."""
REAR_AXLE = 0.15
"""[m] Distance of the rear axle behind the tracker, consistent with the filter's car model."""
TURN = 0.8
"""[rad/s] Mean rate of the first node on its circle of 1 m; other nodes are up to 50 % faster."""
SWAY, SWAY_RATE = 0.6, 0.9
"""[rad], [rad/s] Phase modulation: the lever arm is unobservable at a constant rate."""


@dataclass(frozen=True)
class Workload:
    """Nodes that move on separate circles and range in steps."""

    n: int
    """[-] Number of nodes."""
    dimensions: Literal[2, 3]
    """[-] 2 for cars, 3 for body trackers."""
    step: Literal["round", "message"]
    """All pairs range in a step, or one node in turn ranges to half the group."""

    @cached_property
    def constellation(self) -> Constellation:
        """The nodes."""
        vehicle = "car" if self.dimensions == 2 else "human"
        nodes = tuple(NodeConfig(id=k, vehicle=vehicle) for k in range(self.n))
        return Constellation(nodes=nodes, dimensions=self.dimensions)

    @property
    def rounds_hz(self) -> float:
        """[1/s] Largest rate of rounds for the airtime."""
        return round_rate(PAPER_PHY, self.n)

    @property
    def dt(self) -> float:
        """[s] Period of the steps.

        Not less than 20 rounds, or messages of 2 rounds, per second; large groups reach these
        rates with a radio of a higher bit rate.
        """
        if self.step == "round":
            return 1.0 / max(self.rounds_hz, 20.0)
        return 1.0 / (max(self.rounds_hz, 2.0) * self.n)

    @cached_property
    def pairs(self) -> I64:
        """Pairs that range in each step, (step, pair, 2), i < j; the sequence repeats."""
        if self.step == "round":
            return self.constellation.pairs[None]
        i = np.arange(self.n)[:, None]
        j = (i + np.arange(1, max(self.n // 2, 1) + 1)) % self.n
        i = np.broadcast_to(i, j.shape)
        return np.stack([np.minimum(i, j), np.maximum(i, j)], axis=-1)

    @cached_property
    def _centres(self) -> F64:
        """[m] Centres of the circles, evenly on a disc, in 3D at three heights, (node, 3)."""
        k = np.arange(self.n)
        radius, angle = 3.0 * np.sqrt(k + 0.7), k * 2.4
        height = 1.5 * (k % 3) if self.dimensions == 3 else 0.0 * k
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)

    @cached_property
    def _rates(self) -> F64:
        return TURN * (1.0 + 0.5 * np.arange(self.n) / self.n)

    def _phase(self, t: F64) -> F64:
        """Return the phase of the nodes on their circles, (time, node) [rad]."""
        k = np.arange(self.n)
        return self._rates * t[:, None] + k + SWAY * np.sin(SWAY_RATE * t[:, None] + k)

    def _on_circle(self, t: F64) -> F64:
        phase = self._phase(t)
        heave = 0.4 * np.sin(1.3 * phase) if self.dimensions == 3 else 0.0 * phase
        return np.stack([np.cos(phase), np.sin(phase), heave], axis=-1)

    def pos(self, t: F64) -> F64:
        """Return positions, (time, node, 3) [m]."""
        return self._centres + self._on_circle(t)

    def accel(self, t: F64) -> F64:
        """Return accelerations, (time, node, 3) [m/s2]."""
        phase, sway = self._phase(t), SWAY_RATE * t[:, None] + np.arange(self.n)
        rate = self._rates + SWAY * SWAY_RATE * np.cos(sway)
        faster = -SWAY * SWAY_RATE**2 * np.sin(sway)
        heave = 0.52 * np.cos(1.3 * phase) if self.dimensions == 3 else 0.0 * phase
        along = np.stack([-np.sin(phase), np.cos(phase), heave], axis=-1)
        inwards = -((rate[..., None] * [1.0, 1.0, 1.3]) ** 2) * self._on_circle(t)
        accel: F64 = inwards + faster[..., None] * along
        return accel

    def times(self, first: int, steps: int) -> F64:
        """Return the times of steps, (time) [s]; step 0 is at `dt`."""
        t: F64 = np.arange(first + 1, first + steps + 1, dtype=np.float64) * self.dt
        return t

    def distances(self, t: F64, first: int) -> F64:
        """Return the measured ranges of steps, (time, pair) [m].

        Args:
            t: Times of the steps, (time) [s].
            first: Index of the first step.
        """
        who = self.pairs[(first + np.arange(len(t))) % len(self.pairs)]
        pos, rows = self.pos(t), np.arange(len(t))[:, None]
        exact = np.linalg.norm(pos[rows, who[..., 1]] - pos[rows, who[..., 0]], axis=-1)
        noise = np.random.default_rng(first).normal(0.0, RANGE_STD, exact.shape)
        measured: F64 = np.maximum(exact + noise, 0.1)
        return measured

    def block(self, first: int, steps: int) -> MeasurementBlock:
        """Return the measurements of steps in order of time.

        Args:
            first: Index of the first step.
            steps: Number of steps.
        """
        t = self.times(first, steps)
        values = np.zeros((steps, self.n, 7))
        slip = np.arcsin(REAR_AXLE) if self.dimensions == 2 else 0.0
        yaw: F64 = self._phase(t) + 0.5 * np.pi - slip
        values[..., :4], values[..., 4:] = quat_from_yaw(yaw), self.accel(t)
        node = np.broadcast_to(np.arange(self.n), (steps, self.n)).ravel()
        states = MeasurementBlock.of_kind(
            Kind.STATE, np.repeat(t, self.n), node, values.reshape(-1, 7)
        )
        who = self.pairs[(first + np.arange(steps)) % len(self.pairs)].reshape(-1, 2)
        i, j = np.ascontiguousarray(who[:, 0]), np.ascontiguousarray(who[:, 1])
        distance = self.distances(t, first)
        ranges = MeasurementBlock.of_kind(
            Kind.RANGE,
            np.repeat(t, distance.shape[1]),
            i,
            distance.reshape(-1, 1),
            j=j,
            antennas=(i, j),
        )
        return MeasurementBlock.concatenate([states, ranges]).sorted()
