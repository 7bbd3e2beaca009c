"""Record a simulated run (`relpos simulate`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.registry import look_up
from relpos_env.scenarios import HumanScenario, Scenario, recordable
from relpos_env.scenarios.checks import MOST_CARS
from relpos_env.sensors.radio.channel import CHANNELS
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.timing import DT, STAND_STILL
from tracking.log import Log, check_target, write_log

DECISION = 10
"""[-] Steps of the world per control step of the drivers."""

Progress = Callable[[float], None]


def simulate(
    *,
    scenario: str = "cars-nlos",
    seconds: float = 120.0,
    seed: int = 0,
    cars: int | None = None,
    channel: str | None = None,
    antenna_delay: float | None = None,
    out: Path | str | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Log:
    """Simulate driven cars or an exercising person, and record the measurements of the trackers.

    Args:
        scenario: One of `relpos_env.scenarios.RECORDABLE`, or a TOML file.
        seconds: Length of the recording [s]; no car moves in the first two.
        seed: Seed; the same seed gives the same recording, bit for bit.
        cars: Number of cars; by default that of the scenario. Not for scenarios with a person.
        channel: Radio channel, one of `relpos_env.sensors.radio.channel.CHANNELS`; by default that
            of the scenario.
        antenna_delay: Standard deviation of the range offset of each antenna [m], for calibration
            recordings; by default that of the scenario.
        out: Path of the log folder; None writes nothing.
        overwrite: Whether a log in that folder is replaced.
        progress: Called with the share done, 0 to 1.

    Raises:
        EnvError: No such scenario or channel, or a number out of range.
        LogError: `out` exists already.
    """
    if not 3.0 <= seconds <= 86400.0:
        raise EnvError(f"seconds: expected 3 to 86400, got {seconds:g}")
    if seed < 0:
        raise EnvError(f"seed: expected 0 or more, got {seed}")
    if out is not None:
        check_target(Path(out), overwrite=overwrite)
    chosen = recordable(scenario)
    chosen = replace(chosen, radio=_radio(chosen.radio, channel, antenna_delay))
    if isinstance(chosen, HumanScenario):
        if cars is not None:
            raise EnvError(f"cars: scenario {scenario!r} has a person and no cars, got {cars}")
    elif cars is not None:
        if not 2 <= cars <= MOST_CARS:
            raise EnvError(f"cars: expected 2 to {MOST_CARS}, got {cars}")
        drawn = chosen.randomisation.n_cars
        most = min(chosen.n_cars_range[1], drawn[1] if drawn else MOST_CARS)
        if cars > most:
            raise EnvError(f"cars: expected at most {most} in scenario {scenario!r}, got {cars}")
        chosen = chosen.with_cars(cars)
    log = record(chosen, seconds=seconds, seed=seed, progress=progress)
    if channel is not None or antenna_delay is not None:
        place = f"channel {channel or 'of the scenario'}"
        if antenna_delay is not None:
            place += f", antenna delays {antenna_delay:g} m"
        log = replace(log, source=f"{log.source}, {place}")
    if out is not None:
        write_log(out, log, overwrite=overwrite)
    return log


def record(
    scenario: Scenario | HumanScenario,
    *,
    seconds: float,
    seed: int,
    progress: Progress | None = None,
) -> Log:
    """Record a scenario, registered or not.

    Args:
        scenario: The world and its sensors.
        seconds: Length of the recording [s]; no car moves in the first two.
        seed: Seed; the same seed gives the same recording, bit for bit.
        progress: Called with the share done, 0 to 1.

    Raises:
        EnvError: The length is too large for a person.
    """
    rng, name = np.random.default_rng(seed), f"{scenario.name}-{seed}"
    if isinstance(scenario, HumanScenario):
        return _exercise(scenario, seconds, rng, name, progress)
    return _drive(scenario, seconds, rng, name, progress)


def _radio(
    radio: RadioSimParams, channel: str | None, antenna_delay: float | None
) -> RadioSimParams:
    """Return the radio of the scenario with another channel and antenna delay, if given."""
    if channel is not None:
        radio = replace(radio, channel=look_up(CHANNELS, channel, "channel"))
    if antenna_delay is not None:
        if not 0.0 <= antenna_delay <= 10.0:
            raise EnvError(f"antenna delay: expected 0 to 10 m, got {antenna_delay:g}")
        radio = replace(radio, antenna_delay_std=antenna_delay)
    return radio


def _drive(
    scenario: Scenario, seconds: float, rng: np.random.Generator, name: str, tell: Progress | None
) -> Log:
    """Record cars with scripted drivers."""
    from relpos_env.interface.actions import DriveCommand
    from relpos_env.simulation.scripted_driver import LoopDrivers
    from relpos_env.simulation.simulation import Simulation

    sim = Simulation(scenario, rng, seconds=seconds)
    n = sim.constellation.n_nodes
    drivers = LoopDrivers(scenario, sim.driver_rng, n)
    still = DriveCommand(0.0, np.zeros(n), np.zeros(n))
    n_decisions = round(seconds / (DECISION * DT))
    for k in range(n_decisions):
        parked = sim.t < STAND_STILL
        sim.step(still if parked else drivers.command(sim.state))
        if tell is not None:
            tell((k + 1) / n_decisions)
    return sim.to_log(name)


def _exercise(
    scenario: HumanScenario,
    seconds: float,
    rng: np.random.Generator,
    name: str,
    tell: Progress | None,
) -> Log:
    """Record an exercising person."""
    from relpos_env.people.simulation import BodySimulation

    n_chunks = round(seconds / (DECISION * DT))
    sim = BodySimulation(scenario, rng, n_chunks * DECISION * DT, record=True)
    for k in range(n_chunks):
        sim.step(DECISION)
        if tell is not None:
            tell((k + 1) / n_chunks)
    return sim.to_log(name)
