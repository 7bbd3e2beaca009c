"""Episodes of one contender in one setting, a batch at a time.

Law: the figures of a simulated episode follow from contender, setting and seed alone, bit for
bit; neither the episodes next to it in the batch nor the number of jobs change them.
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
    """Drive one simulated episode for each seed, side by side.

    Args:
        contender: Drives all cars.
        setting: Where.
        seeds: Of the episodes.

    Raises:
        EnvError: The setting makes no sense.
        UsageError: No driver of that name.
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
    """Drive episodes to their ends.

    Args:
        running: Simulated or real, just begun.
        driver: Of all cars.
        seeds: Of the episodes.
        first_scored: Number of the first decision whose errors count.
        after: Called after every decision.
    """
    meter = Meter(running)
    while meter.going.any():
        decide(running, driver)
        meter.read()
        if after is not None:
            after()
    return [meter.result(e, seed, first_scored) for e, seed in enumerate(seeds)]


def decide(running: Running, driver: Driver) -> None:
    """One decision of all cars."""
    # One environment at a time: sums over a batch may be rounded otherwise than alone.
    running.step(np.stack([driver.act(seen) for seen in running.observations]))


def film_episode(contender: Contender, setting: Setting, seed: int) -> dict[str, Any]:
    """Frames of one simulated episode for the animation, see `agents.simulation.frames`.

    Args:
        contender: Drives all cars.
        setting: Where.
        seed: Of the episode.
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
    """Environments with an episode each, and who drives in them."""
    entry = find_entry(contender.name)
    parts = setting.parts(contender.observation, entry.history, contender.proximity)
    driver = entry.driver(contender.observation, parts.n_cars, contender.proximity)
    return Simulated(parts, seeds), driver
