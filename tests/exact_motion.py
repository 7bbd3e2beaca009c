"""Groups of every vehicle in smooth motion, with exact orientations, accelerations and ranges."""

import numpy as np

from tracking.constellation import Constellation, NodeConfig
from tracking.measurements import Kind, MeasurementBlock
from tracking.vehicles import VEHICLES

FINE = 1000.0
STAND, RAMP, GLIDE = 2.0, 1.0, 10.0


class ExactGroup:
    """Nodes on circles of their own, or cars on curves, in one numbering.

    A group that starts at rest stands still for `STAND` and then speeds up within `RAMP` seconds.
    Cars have the rear axle and the slip that the filter assumes. Accelerations are means until the
    next sample, as filters hold them.
    """

    def __init__(self, vehicle, numbering, *, hz=50.0, at_rest=False, dimensions=2, seconds=12.0):
        n = len(numbering)
        self.dimensions = dimensions
        self.constellation = Constellation(
            nodes=tuple(NodeConfig(id=10 + k, vehicle=vehicle, imu_hz=hz) for k in range(n)),
            dimensions=dimensions,
        )
        self.fine = np.arange(-0.1, seconds + 0.2, 1.0 / FINE)
        u = np.clip((self.fine - STAND) / RAMP, 0.0, 1.0)
        pace = u**3 * (10.0 - 15.0 * u + 6.0 * u**2) if at_rest else np.ones_like(u)
        s, k = np.cumsum(pace)[:, None] / FINE, np.arange(n)
        rate = 0.9 + 0.35 * k
        centre = 2.0 * np.stack([np.cos(2.4 * k), np.sin(2.4 * k), 0.5 * np.cos(5.0 * k)], -1)
        if vehicle == "car":
            pos, yaw = self._drive(s, pace[:, None], rate, k, centre)
        else:
            phase = rate * s + k
            axes = [np.cos(phase), np.sin(phase), 0.5 * np.sin(1.4 * phase)]
            pos, yaw = centre + np.stack(axes, axis=-1), np.zeros_like(phase)
        pos[..., dimensions:] = 0.0
        order = np.asarray(numbering)
        self.pos, self._yaw = pos[:, order], yaw[:, order]
        self._vel = np.gradient(self.pos, self.fine, axis=0)
        self.t = np.arange(1, int(seconds * hz)) / hz
        self.block = self._measure(1.0 / hz)

    @staticmethod
    def _drive(s, pace, rate, k, centre):
        car = VEHICLES["car"]
        forward = (0.8 + 0.15 * np.sin(0.7 * s + k)) * pace
        turn = rate * (0.8 + 0.2 * np.cos(0.5 * s + 2 * k)) * pace
        yaw = np.cumsum(turn, axis=0) / FINE + k
        sideways = car.ahead * turn - car.slip * turn * forward**2
        c, s = np.cos(yaw), np.sin(yaw)
        vel = np.stack([forward * c - sideways * s, forward * s + sideways * c, 0.0 * c], -1)
        pos = np.cumsum(vel, axis=0) / FINE
        return pos - pos.mean(axis=0) + centre * [1.0, 1.0, 0.0], yaw

    def pairs(self, t):
        """Return true relative positions, (time, pair, 3)."""
        pos = self.at(self.pos, t)
        i, j = self.constellation.pairs.T
        return pos[:, j] - pos[:, i]

    def at(self, values, t):
        flat = values.reshape(len(values), -1)
        columns = [np.interp(t, self.fine, column) for column in flat.T]
        return np.stack(columns, axis=-1).reshape(len(t), *values.shape[1:])

    def _measure(self, dt):
        t, parts = self.t, []
        accel = (self.at(self._vel, t + dt) - self.at(self._vel, t)) / dt
        half = 0.5 * self.at(self._yaw, t)
        for k in range(self.constellation.n_nodes):
            values = np.zeros((len(t), 7))
            values[:, 0], values[:, 3] = np.cos(half[:, k]), np.sin(half[:, k])
            values[:, 4:] = accel[:, k]
            node = np.full(len(t), k)
            parts.append(MeasurementBlock.of_kind(Kind.STATE, t, node, values))
        relative = self.pairs(t)
        for p, (i, j) in enumerate(self.constellation.pairs):
            distance = np.linalg.norm(relative[:, p], axis=-1)[:, None]
            ends = np.full(len(t), i), np.full(len(t), j)
            parts.append(MeasurementBlock.of_kind(Kind.RANGE, t, ends[0], distance, j=ends[1]))
        return MeasurementBlock.concatenate(parts).sorted()


class Gliders(ExactGroup):
    """A group of which two nodes go straight on at a constant velocity from `GLIDE` on.

    Their IMUs then read what they read at rest.
    """

    def _measure(self, dt):
        k = int(np.searchsorted(self.fine, GLIDE))
        later = (self.fine[k:] - self.fine[k])[:, None]
        for n in (1, 2):
            self.pos[k:, n] = self.pos[k, n] + 0.6 * later * self._vel[k, n]
            self._yaw[k:, n] = self._yaw[k, n]
        self._vel = np.gradient(self.pos, self.fine, axis=0)
        return super()._measure(dt)
