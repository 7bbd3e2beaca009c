"""UWB ranges at the rate of the broadcast protocol, with what obstacles do to them.

In a round of n messages every node sends once; the range of a pair belongs to the middle
between their two messages. In line of sight it is the distance with white noise. Behind an
obstacle the first path is late: a bias and an exponential excess are added, the first path is
weaker than the received power tells, and many messages are lost. The numbers are the
prototype's of published indoor measurements: see `docs/simulator.md`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from relpos_env.world import World, WorldState
from tracking.arrays import F64, I64, Bool
from tracking.measurements import Kind, MeasurementBlock
from tracking.ranging.airtime import PAPER_PHY, Phy, message_time


@dataclass(frozen=True, slots=True, kw_only=True)
class RadioSimParams:
    """What the simulated radio does."""

    phy: Phy = field(default=PAPER_PHY)
    """Sets the rate of rounds."""
    noise: float = 0.06
    """[m] Standard deviation of a range in sight."""
    loss: float = 0.01
    """[-] Share of ranges lost in sight."""
    nlos_bias: float = 0.12
    """[m] Least excess of a range behind an obstacle."""
    nlos_excess: float = 0.12
    """[m] Mean of the exponential excess on top."""
    nlos_loss: float = 0.25
    """[-] Share of ranges lost behind an obstacle."""
    max_distance: float = 60.0
    """[m] No range beyond."""
    power_1m: float = -60.0
    """[dBm] Received power at a metre; it falls with the square of the distance."""
    power_noise: float = 1.0
    """[dB]"""
    gap_los: tuple[float, float] = (3.0, 0.7)
    """[dB] Received minus first-path power in sight: mean, standard deviation."""
    gap_nlos: tuple[float, float] = (8.0, 2.0)
    """[dB] Likewise behind an obstacle."""
    antenna_height: float = 0.12
    """[m] Of the antenna over the tracker; the same on every car."""


@dataclass(frozen=True, slots=True)
class Ranges:
    """What the radio heard in one step."""

    block: MeasurementBlock
    nlos: Bool
    """True where an obstacle stood between, (range)."""


class Radio:
    """The radios of all cars. Laws: same seed, same stream; no errors, the distance."""

    def __init__(self, params: RadioSimParams, n_cars: int, rng: np.random.Generator) -> None:
        self._params, self._rng, self._n = params, rng, n_cars
        self._pairs: I64 = np.stack(np.triu_indices(n_cars, k=1), axis=1).astype(np.int64)
        t_msg = message_time(params.phy, n_cars)
        self._round = n_cars * t_msg
        # Middle of the messages of i and j, from the start of the round.
        self._offset: F64 = 0.5 * (self._pairs.sum(axis=1) + 1.0) * t_msg
        order = np.argsort(self._offset, kind="stable")
        self._pairs, self._offset = self._pairs[order], self._offset[order]
        self._next = 0

    def listen(self, world: World, before: WorldState, after: WorldState) -> Ranges:
        """The ranges of the step that led from one state to the next.

        Args:
            world: Tells what stands between two points.
            before: State at the start of the step.
            after: State at its end.
        """
        p = self._params
        times, pairs = self._due(before.t, after.t)
        m = len(times)
        share = (times - before.t) / (after.t - before.t)
        # Every range draws as much, heard or not: what is lost changes no later draw.
        noise, power_noise, gap_noise = self._rng.standard_normal((3, m))
        excess, luck = self._rng.exponential(size=m), self._rng.random(m)
        i, j = pairs[:, 0], pairs[:, 1]
        pos = before.pos_w + share[:, None, None] * (after.pos_w - before.pos_w)
        rows = np.arange(m)
        a, b = pos[rows, i], pos[rows, j]
        distance = np.linalg.norm(b - a, axis=1)
        nlos = np.array([not world.line_of_sight(a[k], b[k]) for k in range(m)], dtype=bool)
        measured = distance + p.noise * noise
        measured += np.where(nlos, p.nlos_bias + p.nlos_excess * excess, 0.0)
        heard = luck >= np.where(nlos, p.nlos_loss, p.loss)
        heard &= (distance <= p.max_distance) & (measured > 0.0)
        power = (
            p.power_1m - 20.0 * np.log10(np.maximum(distance, 0.1)) + p.power_noise * power_noise
        )
        gap_mean = np.where(nlos, p.gap_nlos[0], p.gap_los[0])
        gap_std = np.where(nlos, p.gap_nlos[1], p.gap_los[1])
        gap = np.maximum(gap_mean + gap_std * gap_noise, 0.0)
        values = np.stack([measured, power, power - gap], axis=1)[heard]
        block = MeasurementBlock.of_kind(
            Kind.RANGE,
            times[heard],
            i[heard],
            values,
            j=j[heard],
            antennas=(i[heard], j[heard]),
            has_power=np.ones(int(heard.sum()), dtype=bool),
        )
        return Ranges(block, nlos[heard])

    def _due(self, start: float, end: float) -> tuple[F64, I64]:
        """Times and pairs of the ranges in (start, end]; counted, so none is lost or doubled."""
        n_pairs = len(self._pairs)
        times, pairs = [], []
        while True:
            number, k = divmod(self._next, n_pairs)
            t = number * self._round + self._offset[k]
            if t > end:
                break
            times.append(t)
            pairs.append(self._pairs[k])
            self._next += 1
        return np.array(times), np.array(pairs, dtype=np.int64).reshape(-1, 2)
