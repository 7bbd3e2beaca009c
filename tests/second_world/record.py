"""A run of the second world as a log, and the parameters of a filter that match the world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.second_world.motion import drive
from tests.second_world.sensors import G, in_space, read_imu, read_ranges
from tests.second_world.space import fly
from tests.second_world.world import World
from tracking.constellation import Constellation, NodeConfig
from tracking.filters.joint.params import (
    JointParams,
    NlosParams,
    NoiseLearningParams,
    RangeErrorParams,
)
from tracking.log import Log
from tracking.log.truth import Truth
from tracking.measurements import Kind, MeasurementBlock
from tracking.mount import Mount
from tracking.vehicles import VEHICLES

TRUTH_HZ = 25.0


def record(world: World, *, vehicle: str | None = None, is_known: bool = False) -> Log:
    """Simulate a run and return its log.

    Args:
        world: World of the run.
        vehicle: Vehicle of the nodes in the log; None for the true one.
        is_known: True if the log contains the mounts of the trackers.
    """
    rng = np.random.default_rng([world.seed, 2])
    motions = drive(world, rng) if world.kind == "car" else fly(world, rng)
    n = len(motions)
    blocks, truths = [], []
    for k, (motion, v) in enumerate(zip(motions, world.vehicles, strict=True)):
        t = (np.arange(int(world.seconds * world.imu.hz)) + rng.random()) / world.imu.hz
        values, node = read_imu(world, v, motion, t, rng), np.full(len(t), k)
        blocks.append(MeasurementBlock.of_kind(Kind.IMU, t, node, values[:, :6]))
        blocks.append(MeasurementBlock.of_kind(Kind.MAG, t, node, values[:, 6:]))
        t = np.arange(int(world.seconds * TRUTH_HZ)) / TRUTH_HZ
        quat = motion.turns(t).as_quat()[:, [3, 0, 1, 2]]
        truths.append((t, np.full(len(t), k), in_space(motion.place(t)), quat))
    rows = read_ranges(world, motions, rng)
    i, j = rows[:, 1].astype(np.int64), rows[:, 2].astype(np.int64)
    blocks.append(
        MeasurementBlock.of_kind(
            Kind.RANGE, rows[:, 0], i, np.column_stack([rows[:, 3], 0 * rows[:, :2]]), j=j
        )
    )
    block = MeasurementBlock.concatenate(blocks)
    order = np.lexsort((block.j[0], block.i[0], block.kind[0], block.t[0]))
    block = block.take(order)
    by_pair = np.lexsort((j, i, rows[:, 0]))
    t, node, pos, q = (np.concatenate(part) for part in zip(*truths, strict=True))
    order = np.lexsort((node, t))
    yes = np.ones(len(t), dtype=bool)
    mounts = [Mount(ahead=v.ahead, aside=v.aside, slip=0.0) for v in world.vehicles]
    nodes = tuple(
        NodeConfig(
            id=k + 1,
            vehicle=vehicle or world.kind,
            imu_hz=world.imu.hz,
            mount=mounts[k] if is_known else Mount(),
        )
        for k in range(n)
    )
    return Log(
        name=f"second-world-{world.seed}",
        constellation=Constellation(nodes=nodes, dimensions=2 if world.kind == "car" else 3),
        block=block,
        truth=Truth(t[order], node[order], pos[order], q[order], yes, yes),
        nlos=rows[by_pair, 4] > 0.0,
    )


def matched(world: World) -> JointParams:
    """Return the parameters of the joint filter that match the world, for the bound."""
    imu, radio, field = world.imu, world.radio, world.field
    ways = 2.0 * np.mean([0.5 * v.top_speed for v in world.vehicles])
    noise = float(np.hypot(imu.acc_noise, 0.6 * imu.vibration) / np.sqrt(imu.hz))
    known = replace(
        VEHICLES[world.kind],
        accel_psd=noise,
        bias_std=float(np.hypot(imu.acc_bias, G * np.radians(0.7))),
        heading_std=float(np.hypot(np.hypot(field.bend, field.iron) / field.level, 0.018)),
        heading_tau=5.0,
        first_heading_std=None,
    )
    if world.kind == "car":
        known = replace(known, sideways_std=0.005)
    never = 1e-9
    share = max(radio.long_share, never)
    mean, spread = 1.25, 0.43
    nlos = NlosParams(
        los_to_nlos_rate=share / radio.long_time,
        nlos_to_los_rate=(1.0 - share) / radio.long_time,
        nlos_bias=mean,
        nlos_bias_std=spread,
        nlos_bias_length=radio.long_time * ways,
        white_std=1e-3,
        outlier_prob=never,
    )
    return JointParams(
        vehicles={**VEHICLES, world.kind: known},
        range_error=RangeErrorParams(
            white_std=radio.white,
            fast_std=1e-4,
            slow_std=max(radio.slow, 1e-4),
            slow_length=radio.slow_time * ways,
        ),
        nlos=nlos,
        nlos_in_space=nlos,
        noise_learning=NoiseLearningParams(learns=False),
    )
