"""The simulation: a world with sensors, stepped by commands, giving blocks of measurements.

It has no notion of agents, rewards or episodes. The blocks it gives are all that a tracker
ever gets; recorded to a log and tracked from there they give the same estimates.
"""

from __future__ import annotations

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.interface.actions import DriveCommand
from relpos_env.recording import Recording, inertial_blocks, range_block
from relpos_env.scenarios import Scenario
from relpos_env.sensors import Imu, Magnetometer, Odometer, Radio
from relpos_env.timing import DT
from relpos_env.world import World, WorldState
from tracking.arrays import F64, Bool
from tracking.constellation import Antenna, Constellation, NodeConfig
from tracking.geometry import quat_from_yaw
from tracking.log import Log
from tracking.measurements import MeasurementBlock


def car_constellation(scenario: Scenario) -> Constellation:
    """The nodes that the cars carry: ids from 1, antenna on a mast over the tracker."""
    ids = range(1, scenario.n_cars + 1)
    height = scenario.radio.antenna_height
    return Constellation(
        nodes=tuple(NodeConfig(id=k, vehicle="car", imu_hz=1.0 / DT) for k in ids),
        dimensions=2,
        heading="magnetic",
        antennas=tuple(Antenna(id=k, node=k, offset_b=(0.0, 0.0, height)) for k in ids),
    )


class Simulation:
    """One group of cars. Law: same scenario, seed and commands, same everything, bit for bit."""

    def __init__(
        self, scenario: Scenario, rng: np.random.Generator, *, record: bool = False
    ) -> None:
        self.scenario = scenario
        self.constellation = car_constellation(scenario)
        # A generator for each part, so that no part's draws depend on another's.
        start, imu, mag, odometer, radio, self.driver_rng = rng.spawn(6)
        n = scenario.n_cars
        self.world = World(scenario.room, scenario.obstacles, scenario.car, scenario.start(start))
        self._imu = Imu(scenario.imu, n, imu, DT)
        self._mag = Magnetometer(scenario.mag, n, mag)
        self._odometer = Odometer(scenario.odometer, n, odometer)
        self._radio = Radio(scenario.radio.for_nodes(n), n, [int(radio.integers(1 << 63))], DT)
        for k in range(n):
            self._radio.switch_on(0, k, boot=int(radio.integers(256)))
        self.odometer_speed: F64 = np.zeros(n)
        """Last odometer reading, (car) [m/s]."""
        self.nlos_share = 0.0
        """Share of the ranges of the last step that an obstacle was in the way of."""
        self.recording = Recording() if record else None

    @property
    def state(self) -> WorldState:
        """The truth now."""
        return self.world.state

    @property
    def t(self) -> float:
        """Time [s]."""
        return self.world.state.t

    def step(self, command: DriveCommand, n_steps: int = 10) -> MeasurementBlock:
        """Drive for some steps of `DT` and return all that was measured, in order."""
        blocks: list[MeasurementBlock] = []
        labels: list[Bool] = []
        for _ in range(n_steps):
            before = self.world.state
            after = self.world.step(command, DT)
            blocks += self._sample_inertial(after)
            ranges, nlos = self._range(before, after)
            blocks.append(ranges)
            labels.append(nlos)
            if self.recording is not None:
                pos = np.column_stack([after.pos_w, np.zeros(len(after.pos_w))])
                self.recording.add_truth(after.t, pos, quat_from_yaw(after.heading))
        self.odometer_speed = self._odometer.sample(self.world.state.speed)
        nlos = np.concatenate(labels)
        self.nlos_share = float(nlos.mean()) if len(nlos) else 0.0
        block = MeasurementBlock.concatenate(blocks)
        if self.recording is not None:
            self.recording.add_block(block, nlos)
        return block.sorted()

    def to_log(self, name: str, *, truth_every: int = 2) -> Log:
        """What was recorded, as a log with truth.

        Args:
            name: Its name.
            truth_every: Truth of every so-manieth step; 2 is 50 Hz.
        """
        if self.recording is None:
            raise EnvError("record: expected True when the simulation was made")
        return self.recording.to_log(
            name, self.scenario.name, self.constellation, truth_every=truth_every
        )

    def _range(self, before: WorldState, after: WorldState) -> tuple[MeasurementBlock, Bool]:
        """Ranges that the nodes resolved in a step, and which of them lacked line of sight."""
        ranges = self._radio.step(
            self._antennas(before), self._antennas(after), self.world.boxes[None]
        )
        return range_block(ranges)

    def _antennas(self, state: WorldState) -> F64:
        """Where the antennas are, (1, car, 3) [m]."""
        pos = np.full((1, self.scenario.n_cars, 3), self.scenario.radio.antenna_height)
        pos[0, :, :2] = state.pos_w
        return pos

    def _sample_inertial(self, state: WorldState) -> list[MeasurementBlock]:
        """IMU and magnetometer of every car."""
        imu = self._imu.sample(state.heading, state.yaw_rate, state.accel_w, state.speed)
        mag = self._mag.sample(state.pos_w, state.heading)
        return inertial_blocks(state.t, imu, mag)
