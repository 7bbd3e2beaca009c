"""Simulation of a person: a motion with sensors, which gives blocks of measurements.

The counterpart of `relpos_env.simulation.simulation` without physics: the motion of the trackers
is given, and their measurements follow from it.
"""

from __future__ import annotations

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.people.clips import load_clips
from relpos_env.people.motion import SITES, BodyMotion, BodySamples
from relpos_env.people.procedural import procedural_body
from relpos_env.people.recorded import recorded_body
from relpos_env.scenarios import HumanScenario
from relpos_env.sensors import Imu, Magnetometer, Radio
from relpos_env.simulation.recorder import Recording, inertial_blocks, range_block
from relpos_env.timing import DT, STAND_STILL
from tracking.arrays import Bool
from tracking.constellation import Constellation, NodeConfig
from tracking.log import Log
from tracking.measurements import MeasurementBlock

LONGEST = 1800.0
"""[s] Longest run: the whole motion is held in memory, up to 0.7 MB per second."""


def human_constellation() -> Constellation:
    """Return the nodes of a person: ids from 1 in the order of `SITES`, antennas at the origin."""
    return Constellation(
        nodes=tuple(
            NodeConfig(id=k + 1, vehicle="human", imu_hz=1.0 / DT) for k in range(len(SITES))
        ),
        dimensions=3,
        heading="magnetic",
    )


class BodySimulation:
    """One person. Equal scenarios, lengths and seeds give equal results, bit for bit."""

    def __init__(
        self,
        scenario: HumanScenario,
        rng: np.random.Generator,
        seconds: float,
        *,
        record: bool = False,
    ) -> None:
        """Generate the motion and switch the trackers on.

        Args:
            scenario: Motion, room and sensors.
            rng: Generator of all random numbers.
            seconds: Length of the run [s].
            record: True to record everything for a log.

        Raises:
            EnvError: The run is too long, an exercise is unknown, or motion capture is missing.
        """
        if not 0.0 < seconds <= LONGEST:
            raise EnvError(f"seconds: expected at most {LONGEST:g} for people, got {seconds:g}")
        self.scenario = scenario
        self.constellation = human_constellation()
        # A generator for each part, so that no part's draws depend on another's.
        body, imu, mag, radio = rng.spawn(4)
        n = len(SITES)
        self.motion = BodyMotion(_samples(scenario, seconds, body))
        self._imu = Imu(scenario.imu, n, imu, DT)
        self._mag = Magnetometer(scenario.mag, n, mag)
        self._radio = Radio(scenario.radio.for_nodes(n), n, [int(radio.integers(1 << 63))], DT)
        for k in range(n):
            self._radio.switch_on(0, k, boot=int(radio.integers(256)))
        self._steps = 0
        self._n_steps = round(seconds / DT)
        self.recording = Recording() if record else None

    @property
    def t(self) -> float:
        """Time [s]."""
        return self._steps * DT

    def step(self, n_steps: int = 10) -> MeasurementBlock:
        """Simulate some steps of `DT` and return all measurements in order of time.

        Args:
            n_steps: Number of steps, not beyond the end of the run.

        Raises:
            EnvError: The run is over.
        """
        if self._steps + n_steps > self._n_steps:
            raise EnvError(f"step: the run of {self._n_steps * DT:g} s ends before that")
        t = DT * np.arange(self._steps, self._steps + n_steps + 1, dtype=np.float64)
        body = self.motion.at(t)
        limbs = self.motion.obstacles(t[1:] - 0.5 * DT)
        speed = np.linalg.norm(body.vel_w, axis=-1)
        blocks: list[MeasurementBlock] = []
        labels: list[Bool] = []
        for k in range(1, n_steps + 1):
            imu = self._imu.sample_3d(body.q_wb[k], body.rate_b[k], body.accel_w[k], speed[k])
            mag = self._mag.sample_3d(body.pos_w[k], body.q_wb[k])
            blocks += inertial_blocks(float(t[k]), imu, mag)
            ends = body.pos_w[None, k - 1], body.pos_w[None, k]
            ranges, nlos = range_block(self._radio.step(*ends, capsules=limbs[None, k - 1]))
            blocks.append(ranges)
            labels.append(nlos)
            if self.recording is not None:
                self.recording.add_truth(float(t[k]), body.pos_w[k], body.q_wb[k])
        self._steps += n_steps
        block = MeasurementBlock.concatenate(blocks)
        if self.recording is not None:
            self.recording.add_block(block, np.concatenate(labels))
        return block.sorted()

    def to_log(self, name: str, *, truth_every: int = 1) -> Log:
        """Return the recording as a log with truth.

        Args:
            name: Name of the log.
            truth_every: Steps per sample of the truth; 1 is 100 Hz, since limbs move fast.

        Raises:
            EnvError: Nothing was recorded.
        """
        if self.recording is None:
            raise EnvError("record: expected True when the simulation was made")
        return self.recording.to_log(
            name, self.scenario.name, self.constellation, truth_every=truth_every
        )


def _samples(scenario: HumanScenario, seconds: float, rng: np.random.Generator) -> BodySamples:
    """Return the body of a scenario, which is at rest first while the trackers are switched on."""
    if scenario.motion == "recorded":
        return recorded_body(load_clips(), seconds, STAND_STILL, DT, rng)
    return procedural_body(scenario.exercises, scenario.room, seconds, STAND_STILL, DT, rng)
