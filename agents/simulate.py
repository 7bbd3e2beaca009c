"""Recording a simulated drive: what `relpos simulate` does, as a function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from relpos_env.drivers import LoopDrivers
from relpos_env.errors import EnvError
from relpos_env.interface.actions import DriveCommand
from relpos_env.loop import STAND_STILL
from relpos_env.registry import look_up
from relpos_env.scenarios import scenario as find_scenario
from relpos_env.sensors.radio.channel import CHANNELS
from relpos_env.sim import DT, Simulation
from tracking.log import Log, check_target, write_log

DECISION = 10
"""[-] Steps of the physics between two decisions of the drivers."""


def simulate(
    *,
    scenario: str = "cars-nlos",
    seconds: float = 120.0,
    seed: int = 0,
    cars: int = 3,
    channel: str | None = None,
    antenna_delay: float | None = None,
    out: Path | str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Log:
    """Let people drive cars about and record what their trackers measure, with the truth.

    Args:
        scenario: One of `relpos_env.scenarios.SCENARIOS`.
        seconds: Length of the recording; the cars stand for the first two.
        seed: Same seed, same recording, bit for bit.
        cars: Number of cars.
        channel: What the place does to the radio, one of
            `relpos_env.sensors.radio.channel.CHANNELS`;
            by default that of the scenario.
        antenna_delay: Standard deviation of what each antenna adds to its ranges [m], for
            recordings to calibrate with; by default that of the scenario.
        out: Where to write the log folder; None writes nothing.
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
        check_target(Path(out))
    chosen = replace(find_scenario(scenario), n_cars=cars)
    radio = chosen.radio
    if channel is not None:
        radio = replace(radio, channel=look_up(CHANNELS, channel, "channel"))
    if antenna_delay is not None:
        if not 0.0 <= antenna_delay <= 10.0:
            raise EnvError(f"antenna delay: expected 0 to 10 m, got {antenna_delay:g}")
        radio = replace(radio, antenna_delay_std=antenna_delay)
    chosen = replace(chosen, radio=radio)
    sim = Simulation(chosen, np.random.default_rng(seed), record=True)
    drivers = LoopDrivers(chosen, sim.driver_rng)
    still = DriveCommand(0.0, np.zeros(cars), np.zeros(cars))
    n_decisions = round(seconds / (DECISION * DT))
    for k in range(n_decisions):
        parked = sim.t < STAND_STILL
        sim.step(still if parked else drivers.command(sim.state), DECISION)
        if progress is not None:
            progress((k + 1) / n_decisions)
    log = sim.to_log(f"{scenario}-{seed}")
    if channel is not None or antenna_delay is not None:
        place = f"channel {channel or 'of the scenario'}, antenna delays {antenna_delay or 0:g} m"
        log = replace(log, source=f"{log.source}, {place}")
    if out is not None:
        write_log(out, log)
    return log
