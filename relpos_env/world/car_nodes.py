"""Nodes on the cars."""

from __future__ import annotations

from relpos_env.scenarios import Scenario
from relpos_env.timing import DT
from tracking.constellation import Antenna, Constellation, NodeConfig
from tracking.mount import Mount


def car_constellation(scenario: Scenario, n_cars: int) -> Constellation:
    """Return the nodes on the cars: ids from 1, antenna on a mast over the tracker."""
    ids = range(1, n_cars + 1)
    mounts = [*scenario.mounts, *[Mount()] * n_cars]
    height = scenario.radio.antenna_height
    return Constellation(
        nodes=tuple(
            NodeConfig(id=k, vehicle="car", imu_hz=1.0 / DT, mount=mounts[k - 1]) for k in ids
        ),
        dimensions=2,
        heading="magnetic",
        antennas=tuple(Antenna(id=k, node=k, offset_b=(0.0, 0.0, height)) for k in ids),
    )
