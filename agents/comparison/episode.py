"""Batches of episodes of one candidate in one setting.

Invariant: the metrics of a simulated episode depend only on candidate, setting and seed, bit for
bit, not on the other episodes of the batch or the number of jobs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from agents.comparison.contender import Contender, find_entry
from agents.comparison.meter import EpisodeResult, Meter, Running
from agents.comparison.setting import Setting
from agents.comparison.simulated import Simulated
from agents.driver import Driver
from agents.simulation.frames import FrameRecorder


def run_episodes(
    contender: Contender, setting: Setting, seeds: Sequence[int]
) -> list[EpisodeResult]:
    """Run one simulated episode for each seed, in one batch.

    Args:
        contender: Candidate that drives all cars.
        setting: Scenario and task.
        seeds: Seeds of the episodes.

    Raises:
        EnvError: The setting is invalid.
        UsageError: The driver does not exist.
    """
    simulated, driver = _begin(contender, setting, seeds)
    results = measure(simulated, driver, seeds, setting.first_scored)
    simulated.close()
    return results


def measure(
    running: Running,
    driver: Driver,
    seeds: Sequence[int],
    first_scored: int,
    after: Callable[[], None] | None = None,
) -> list[EpisodeResult]:
    """Run episodes to their ends and measure them.

    Args:
        running: Simulated or real episodes that have just begun.
        driver: Driver of all cars.
        seeds: Seeds of the episodes.
        first_scored: Index of the first control step whose errors are scored.
        after: Called after every control step.
    """
    meter = Meter(running)
    while meter.going.any():
        decide(running, driver)
        meter.read()
        if after is not None:
            after()
    return [meter.result(e, seed, first_scored) for e, seed in enumerate(seeds)]


def decide(running: Running, driver: Driver) -> None:
    """Run one control step of all cars."""
    # One environment at a time: rounding of sums may depend on the batch size.
    running.step(np.stack([driver.act(seen) for seen in running.observations]))


def film_episode(contender: Contender, setting: Setting, seed: int) -> dict[str, Any]:
    """Return the animation frames of one simulated episode, see `agents.simulation.frames`.

    Args:
        contender: Candidate that drives all cars.
        setting: Scenario and task.
        seed: Seed of the episode.
    """
    simulated, driver = _begin(contender, setting, [seed])
    recorder = FrameRecorder(simulated.formation)
    while not simulated.over[0]:
        decide(simulated, driver)
        recorder.add()
    simulated.close()
    return recorder.frames


def _begin(
    contender: Contender, setting: Setting, seeds: Sequence[int]
) -> tuple[Simulated, Driver]:
    """Return environments with one episode each, and the driver of all cars."""
    entry = find_entry(contender.name)
    parts = setting.parts(contender.observation, entry.history, contender.proximity)
    driver = entry.driver(contender.observation, parts.n_cars, contender.proximity)
    return Simulated(parts, seeds), driver
