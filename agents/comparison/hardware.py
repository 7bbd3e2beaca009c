"""Comparison of drivers (controllers and policies) on real cars (`relpos compare --config`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from agents.comparison.arguments import check_numbers, each_once, modes
from agents.comparison.contender import Contender, find_entry, line_up
from agents.comparison.driven import Driven
from agents.comparison.episode import measure
from agents.comparison.meter import EpisodeResult
from agents.comparison.result import CompareResult, Row
from agents.comparison.setting import Setting
from agents.driver import Driver
from agents.errors import UsageError
from agents.simulation.demo import SETTLE
from hardware_bridge.config import SwarmConfig, read_config
from hardware_bridge.errors import BridgeError
from hardware_bridge.live.bridge import Bridge
from hardware_bridge.live.env import HardwareFormationEnv
from hardware_bridge.live.opened import OpenBridge

EPISODES = 10
"""[-] Default number of episodes per driver."""
STOPPED = " stopped: "


def compare_hardware(
    *,
    swarm: SwarmConfig | Path | str,
    drivers: Sequence[str],
    observations: Sequence[str] = ("estimate",),
    arm: bool = False,
    episodes: int = EPISODES,
    seconds: float = 60.0,
    settle: float = SETTLE,
    wait: float = 60.0,
    open_bridge: Callable[[], OpenBridge] | None = None,
    attend: Callable[[Callable[[str], None]], None] | None = None,
    progress: Callable[[float], None] | None = None,
) -> CompareResult:
    """Evaluate drivers on real cars in alternation, in real time, by the tracker's estimates.

    Each round has one episode per driver and begins with a different driver, so that effects such
    as battery discharge or dust on the floor are the same for all. The complete rounds are returned
    if the comparison is interrupted.

    Args:
        swarm: A swarm.toml or the configuration read by `read_config`; it determines the task.
        drivers: As for `agents.comparison.compare.compare`.
        observations: As for `agents.comparison.compare.compare`, without ground truth.
        arm: Permission for the cars to move; required.
        episodes: Episodes per driver and mode.
        seconds: Length of an episode, shorter if the task is accomplished [s].
        settle: Time from which errors are scored [s].
        wait: Longest time to wait for all cars to be healthy before each episode [s].
        open_bridge: Opens the bridge to the cars, by default over their ports.
        attend: Called every 10 ms with a function that accepts commands: ``arm``, ``disarm``,
            ``stop``, ``clear``, or ``quit``, which ends the comparison.
        progress: Called with the completed share, 0 to 1.

    Raises:
        UsageError: A name is unknown, a number out of range, or no combination can be compared;
            the message contains the option.
        BridgeError: A part of the swarm cannot be used, or the cars could not be armed.
    """
    check_numbers(episodes, 0, seconds, settle)
    if not arm:
        raise UsageError("--arm: a comparison needs cars that move; give it when they may")
    config = swarm if isinstance(swarm, SwarmConfig) else read_config(swarm)
    setting = Setting(
        task=config.task.name,
        operator=float(config.task.command == "link"),
        seconds=seconds,
        settle=settle,
    )
    candidates, notes = _compatible_candidates(
        each_once("NAME", drivers), modes(observations), config
    )
    orders, remarks = _Orders(), []

    def opened() -> OpenBridge:
        return Bridge(config, drive=True, arm=True, wait=wait)

    with closing((open_bridge or opened)()) as bridge:
        orders.attend_to(bridge, attend)
        for candidate in candidates:
            candidate.warm_up(bridge)
        try:
            for k in range(episodes):
                _drive_round(bridge, setting, candidates, k, orders)
                if progress is not None:
                    progress((k + 1) / episodes)
        except KeyboardInterrupt:
            remarks.append("Interrupted")
        except BridgeError as error:
            if not all(candidate.rounds for candidate in candidates):
                raise
            remarks.append(f"Ended early: {error}")
        finally:
            try:
                bridge.feed.order("quit")
            except BridgeError as error:
                remarks.append(str(error))
        remarks += [text for _, text in bridge.feed.notices if STOPPED in text]
    rounds = min(len(candidate.rounds) for candidate in candidates)
    if rounds == 0:
        raise UsageError("nothing compared: it ended before every driver had driven once")
    return CompareResult(
        rows=tuple(candidate.row(config, setting, rounds) for candidate in candidates),
        notes=tuple(notes),
        remarks=tuple(remarks),
        first_seed=1,
        seeds=rounds,
        errors_from="estimates",
    )


@dataclass(slots=True)
class _Candidate:
    """A compatible candidate and its episodes."""

    contender: Contender
    trained_on: str | None
    history: int
    driver: Driver
    rounds: list[EpisodeResult] = field(default_factory=list)

    def env(self, bridge: OpenBridge, cycles: int = 1) -> HardwareFormationEnv:
        """Return an environment with the candidate's observations; it invalidates earlier ones."""
        return bridge.env(
            observation=self.contender.observation, history=self.history, max_cycles=cycles
        )

    def warm_up(self, bridge: OpenBridge) -> None:
        """Call the driver once for lazy initialisation, before any deadline applies."""
        for space in self.env(bridge).observation_spaces.values():
            self.driver.act(np.zeros(space.shape, np.float32))

    def row(self, config: SwarmConfig, setting: Setting, rounds: int) -> Row:
        """Return the row of the complete rounds."""
        return Row(
            contender=self.contender,
            trained_on=self.trained_on,
            setting=setting,
            scenario=config.name,
            group=config.name,
            cars=config.n_slots,
            episodes=tuple(self.rounds[:rounds]),
        )


class _Orders:
    """Commands of people during a comparison."""

    def __init__(self) -> None:
        self._quit = False

    def attend_to(
        self, bridge: OpenBridge, attend: Callable[[Callable[[str], None]], None] | None
    ) -> None:
        """Forward commands to a bridge."""

        def take(what: str) -> None:
            self._quit |= what == "quit"
            bridge.start.heed(what)
            bridge.feed.order(what)

        if attend is not None:
            bridge.feed.attend = lambda: attend(take)
        bridge.start.attend = lambda: self._quit

    def check(self) -> None:
        """Raise KeyboardInterrupt if ``quit`` was received; called after every control step."""
        if self._quit:
            raise KeyboardInterrupt


def _drive_round(
    bridge: OpenBridge, setting: Setting, candidates: Sequence[_Candidate], k: int, orders: _Orders
) -> None:
    """Run one episode of every candidate."""
    first = k % len(candidates)
    for candidate in (*candidates[first:], *candidates[:first]):
        driven = Driven(candidate.env(bridge, setting.cycles), setting.cycles)
        try:
            candidate.rounds += measure(
                driven, candidate.driver, [k + 1], setting.first_scored, orders.check
            )
        finally:
            driven.close()


def _compatible_candidates(
    drivers: Sequence[str], observations: Sequence[str], config: SwarmConfig
) -> tuple[list[_Candidate], list[str]]:
    """Return the candidates that are compatible with the cars, and notes on the others."""
    candidates, notes = [], []
    n_rangefinders = config.task.proximity
    for contender in line_up(drivers, observations, n_rangefinders):
        entry = find_entry(contender.name)
        if contender.observation == "truth":
            why: str | None = "real cars know no truth"
        elif entry.proximity is not None and entry.proximity != n_rangefinders:
            why = f"expected {entry.proximity} distance sensors, the cars have {n_rangefinders}"
        else:
            why = entry.refusal(contender.observation, config.n_slots, n_rangefinders)
        if why is not None:
            notes.append(f"{contender.label} in {config.name}: {why}")
            continue
        driver = entry.driver(contender.observation, config.n_slots, n_rangefinders)
        candidates.append(_Candidate(contender, entry.trained_on, entry.history, driver))
    if not candidates:
        raise UsageError("NAME: nothing to compare: " + "; ".join(notes))
    return candidates, notes
