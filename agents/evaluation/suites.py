"""Suites of evaluation cases; a new case is one entry here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from agents.evaluation.changes import (
    clock_offset,
    heading_error,
    imu_dropout,
    range_outliers,
    without_powers,
)
from agents.simulation.simulate import record
from relpos_env.core.oracle_params import matched_params
from relpos_env.scenarios import HumanScenario, Scenario
from relpos_env.scenarios.cars import CARS_LOS, CARS_NLOS
from relpos_env.scenarios.people import HUMAN
from relpos_env.scenarios.randomisation import Randomisation
from relpos_env.sensors.imu import ImuSimParams
from relpos_env.sensors.radio.channel import CALIBRATED, INDOOR, ChannelParams
from tracking.filters.joint.params import JointParams
from tracking.log import Log

Change = Callable[[Log, np.random.Generator], Log]


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One evaluation case."""

    name: str
    about: str
    """Description in one line."""
    scenario: Scenario | HumanScenario
    change: Change | None = None
    """Degradation of the log; None for none. A function at module level, so that it can be
    pickled for other processes."""
    paper: Mapping[str, float] = field(default_factory=dict)
    """[m] Error reported by the paper, by filter."""
    asked: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """[m] Upper limits of metrics, by filter, see `agents.evaluation.targets`."""

    def log(self, seed: int, seconds: float) -> Log:
        """Simulate the log of one seed.

        Args:
            seed: Seed of the log, which it determines bit for bit.
            seconds: Length of the run [s].
        """
        log = record(self.scenario, seconds=seconds, seed=seed)
        if self.change is None:
            return log
        return self.change(log, np.random.default_rng([seed, 1]))

    def bound_params(self, seed: int) -> JointParams:
        """Return the parameters that match the simulation of one seed, for its bound."""
        return matched_params(self.scenario)


@dataclass(frozen=True, slots=True, kw_only=True)
class Suite:
    """Cases that are evaluated together."""

    name: str
    title: str
    cases: tuple[Case, ...]
    seeds: int
    """Default number of seeds, from 0."""
    seconds: float
    """[s] Default length of a run."""


MOUNTS = Randomisation(
    mount_ahead=(-0.15, 0.2), mount_aside=(-0.05, 0.05), friction=(0.8, 1.1), mass=(0.85, 1.2)
)
"""Mounts of trackers between rear axle and front bumper, and randomised cars of level 2."""
PAPER = (
    Case(
        name="cars-los",
        about="three cars in sight of each other",
        scenario=CARS_LOS,
        paper={"paper-ekf": 0.396, "paper-ekf-mds": 0.093},
        asked={"ekf-mds": {"rmse_shape": 0.093}, "joint": {"rmse_yaw": 0.047, "rmse_shape": 0.020}},
    ),
    Case(
        name="cars-nlos",
        about="three cars round an obstacle",
        scenario=CARS_NLOS,
        paper={"paper-ekf": 0.428, "paper-ekf-mds": 0.102},
        asked={"ekf-mds": {"rmse_shape": 0.102}, "joint": {"rmse_yaw": 0.051, "rmse_shape": 0.030}},
    ),
    *(
        Case(
            name=f"{scenario.name}-mount",
            about=f"{scenario.name}, every tracker somewhere else on its car, grip and load drawn",
            scenario=replace(scenario, randomisation=MOUNTS),
        )
        for scenario in (CARS_LOS, CARS_NLOS)
    ),
    Case(
        name="human",
        about="six trackers on a person who exercises",
        scenario=HUMAN,
        paper={"paper-ekf": 0.667, "paper-ekf-mds": 0.217},
        asked={"ekf-mds": {"rmse_shape": 0.217}, "joint": {"rmse_yaw": 0.108, "rmse_shape": 0.070}},
    ),
)
"""Experiments of Armani and Holz, ICRA 2024, section III, with their errors."""


def _channel(channel: ChannelParams) -> Scenario:
    return replace(CARS_NLOS, radio=replace(CARS_NLOS.radio, channel=channel))


def _imu(factor: float, *names: str) -> Scenario:
    imu: ImuSimParams = CARS_NLOS.imu
    return replace(CARS_NLOS, imu=replace(imu, **{n: factor * getattr(imu, n) for n in names}))


ROBUSTNESS = (
    Case(name="as-it-is", about="cars-nlos, to compare with", scenario=CARS_NLOS),
    Case(
        name="message-loss",
        about="15 % of the messages lost in sight and 35 % behind the obstacle, not 0.4 % and 10 %",
        scenario=_channel(replace(CALIBRATED, loss=0.15, loss_nlos=0.35)),
    ),
    Case(
        name="imu-errors",
        about="noise, bias, drift and vibration of every IMU doubled",
        scenario=_imu(
            2.0,
            *("gyr_noise", "acc_noise", "gyr_bias", "acc_bias"),
            *("gyr_drift", "acc_drift", "vibration", "gyr_vibration"),
        ),
    ),
    Case(
        name="indoor",
        about="channel `indoor`: radios without calibration, in a building",
        scenario=_channel(INDOOR),
    ),
    Case(
        name="no-powers",
        about="radios that do not report received and first-path power",
        scenario=CARS_NLOS,
        change=without_powers,
    ),
    Case(
        name="antenna-delays",
        about="antennas that add a constant to all their ranges, 0.3 m (standard deviation)",
        scenario=replace(CARS_NLOS, radio=replace(CARS_NLOS.radio, antenna_delay_std=0.3)),
    ),
    Case(
        name="imu-dropout",
        about="no IMU of one car for 10 s in the middle of the run",
        scenario=CARS_NLOS,
        change=imu_dropout,
    ),
    Case(
        name="clock-offset",
        about="IMU of one car stamped 50 ms too late",
        scenario=CARS_NLOS,
        change=clock_offset,
    ),
    Case(
        name="heading-error",
        about="magnetometer of one car turned by 5 degrees",
        scenario=CARS_NLOS,
        change=heading_error,
    ),
    Case(
        name="line-start",
        about="all cars start on one straight line",
        scenario=replace(CARS_NLOS, in_line=True),
    ),
    Case(
        name="magnetic",
        about="the building bends the magnetic field three times as much",
        scenario=replace(
            CARS_NLOS, mag=replace(CARS_NLOS.mag, disturbance=3.0 * CARS_NLOS.mag.disturbance)
        ),
    ),
    Case(
        name="come-and-go",
        about="a car is taken out every 15 s in the mean, for 5 to 20 s",
        scenario=replace(CARS_NLOS, randomisation=Randomisation(leave_rate=(4.0, 4.0))),
    ),
    Case(
        name="range-outliers",
        about="2 % of the ranges anywhere between 0 m and 20 m",
        scenario=CARS_NLOS,
        change=range_outliers,
    ),
)
"""Faults in practice: each case is cars-nlos with one change."""


def _cars(n: int) -> Case:
    """Return a case of `n` cars, with the floor area per car that three cars have in cars-los."""
    scale = float(np.sqrt(max(n, 3) / 3))
    (x, y), (a, b) = CARS_LOS.room, CARS_LOS.ring
    scenario = replace(CARS_LOS, n_cars=n, room=(scale * x, scale * y), ring=(scale * a, scale * b))
    about = f"{n} cars in {scale * x:.1f} m x {scale * y:.1f} m, in sight of each other"
    return Case(name=f"{n}-cars", about=about, scenario=scenario)


SUITES: dict[str, Suite] = {
    s.name: s
    for s in (
        Suite(
            name="paper",
            title="The experiments of the paper",
            cases=PAPER,
            seeds=50,
            seconds=120.0,
        ),
        Suite(
            name="robustness",
            title="What may go wrong",
            cases=ROBUSTNESS,
            seeds=20,
            seconds=60.0,
        ),
        Suite(
            name="scaling",
            title="Larger groups",
            cases=tuple(_cars(n) for n in (2, 3, 4, 6, 8, 10)),
            seeds=10,
            seconds=60.0,
        ),
    )
}
"""Suites by name."""
