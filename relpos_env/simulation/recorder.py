"""Recording of the measurements and the truth of a simulation, for a log."""

from __future__ import annotations

import numpy as np

from relpos_env.sensors.radio.radio import Ranges
from relpos_env.timing import DT
from relpos_env.world.world import World
from tracking.arrays import F64, Bool
from tracking.constellation import Constellation
from tracking.geometry import quat_from_yaw, quat_multiply
from tracking.log import Log, Truth
from tracking.measurements import Kind, MeasurementBlock


class Recording:
    """Measurements and truth of a run."""

    def __init__(self) -> None:
        self._blocks: list[MeasurementBlock] = []
        self._nlos: list[Bool] = []
        self._truth: list[tuple[float, F64, F64, Bool]] = []

    def add_truth(self, t: float, pos_w: F64, q_wb: F64, present: Bool | None = None) -> None:
        """Append the true poses of the nodes.

        Args:
            t: Time, later than the last [s].
            pos_w: Positions, (node, 3) [m].
            q_wb: Orientations, body to world, (node, 4).
            present: Mask of the present nodes, (node); all if None.
        """
        there = np.ones(len(pos_w), dtype=bool) if present is None else present.copy()
        self._truth.append((t, pos_w, q_wb, there))

    def add_block(self, block: MeasurementBlock, nlos: Bool) -> None:
        """Append the measurements of a step.

        Args:
            block: Measurements in any order.
            nlos: Mask of its ranges without line of sight, (range).
        """
        self._blocks.append(block)
        self._nlos.append(nlos)

    def add_swarm(self, swarm: World) -> None:
        """Append measurements and truth of the last step of the first group."""
        n, events = int(swarm.events.used[0]), swarm.events
        steps = swarm.events.pose[0]
        yaw, roll, pitch = (np.moveaxis(steps, -1, 0)[k] for k in (2, 3, 4))
        q = quat_multiply(quat_from_yaw(yaw), quat_from_tilt(roll, pitch))
        last = round(float(swarm.t[0]) / DT)
        for k, pose in enumerate(steps):
            pos = np.column_stack([pose[:, :2], np.zeros(len(pose))])
            t = (last - len(steps) + 1 + k) * DT
            self.add_truth(t, pos, q[k], swarm.state.present[0])
        block = swarm.block.take(slice(0, n))
        ranges = block.kind[0] == Kind.RANGE
        # Of cars without sensors there are no samples.
        self.add_block(block.take(block.valid[0]), events.nlos[0, :n][ranges])

    def to_log(
        self, name: str, scenario: str, constellation: Constellation, *, truth_every: int
    ) -> Log:
        """Return a log with truth.

        Args:
            name: Name of the log.
            scenario: Name of the scenario, for the source.
            constellation: Nodes of the log.
            truth_every: Number of steps per sample of the truth.
        """
        kept = self._truth[truth_every - 1 :: truth_every]
        n = constellation.n_nodes
        there = np.concatenate([present for *_, present in kept])
        block = MeasurementBlock.concatenate(self._blocks)
        nlos = np.zeros(block.n_events, dtype=bool)
        nlos[block.kind[0] == Kind.RANGE] = np.concatenate(self._nlos)
        order = block.order()[0]
        block = block.take(order)
        return Log(
            name=name,
            source=f"relpos-env simulation, scenario {scenario}",
            licence="CC0-1.0",
            constellation=constellation,
            block=block,
            nlos=nlos[order][block.kind[0] == Kind.RANGE],
            truth=Truth(
                np.repeat([t for t, *_ in kept], n),
                np.tile(np.arange(n, dtype=np.int64), len(kept)),
                np.concatenate([pos for _, pos, *_ in kept]),
                np.concatenate([q for _, _, q, _ in kept]),
                there,
                there,
            ),
        )


def range_block(ranges: Ranges) -> tuple[MeasurementBlock, Bool]:
    """Return the ranges of the first environment, and the mask of those without line of sight."""
    n = int(ranges.count[0])
    i, j = ranges.i[0, :n], ranges.j[0, :n]
    block = MeasurementBlock.of_kind(
        Kind.RANGE,
        ranges.t[0, :n],
        i,
        ranges.values[0, :n],
        j=j,
        antennas=(i, j),
        has_power=np.ones(n, dtype=bool),
    )
    return block, ranges.nlos[0, :n]


def inertial_blocks(t: float, imu: F64, mag: F64) -> list[MeasurementBlock]:
    """Return one IMU and magnetometer sample of every node.

    Args:
        t: Time of the samples [s].
        imu: Samples as returned by `Imu`, (node, 6).
        mag: Magnetic field, (node, 3) [uT].
    """
    times, nodes = np.full(len(imu), t), np.arange(len(imu), dtype=np.int64)
    return [
        MeasurementBlock.of_kind(Kind.MAG, times, nodes, mag),
        MeasurementBlock.of_kind(Kind.IMU, times, nodes, imu),
    ]


def quat_from_tilt(roll: F64, pitch: F64) -> F64:
    """Return the orientation of a body rotated by pitch about y, then by roll about its own x."""
    cr, sr = np.cos(0.5 * roll), np.sin(0.5 * roll)
    cp, sp = np.cos(0.5 * pitch), np.sin(0.5 * pitch)
    q: F64 = np.stack([cp * cr, cp * sr, sp * cr, -sp * sr], axis=-1)
    return q
