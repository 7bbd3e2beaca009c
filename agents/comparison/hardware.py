"""Drivers compared on real cars: what `relpos compare --swarm` does, as a function."""

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
"""[-] Of each driver, where the number is not given."""
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
    """Let drivers drive real cars in turns, in real time, and compare what the cars believe.

    In a round every driver has one episode; each round begins with another of them, so that a
    battery that drains or a floor that gets dusty treats all alike. Interrupted, it gives the
    rounds that are complete.

    Args:
        swarm: A swarm.toml, or what `read_config` made of one; the task is its own.
        drivers: As for `agents.comparison.compare.compare`.
        observations: As for `agents.comparison.compare.compare`, without the truth.
        arm: Whether the cars may move, without which there is nothing to compare.
        episodes: Of each driver and mode.
        seconds: Length of an episode [s], less where the task is done before.
        settle: Errors are scored from here on [s].
        wait: So long is waited for all to be well before each episode [s].
        open_bridge: Opens the cars, by default their ports.
        attend: Called every hundredth of a second with what takes orders: ``arm``, ``disarm``,
            ``stop``, ``clear``, or ``quit``, which ends it.
        progress: Called with the share done, 0 to 1.

    Raises:
        UsageError: A name that is not known, a number out of range, nothing left to compare;
            the option is named.
        BridgeError: Something of the swarm cannot be used, or the cars could not be armed.
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
    seats, notes = _seat(each_once("NAME", drivers), modes(observations), config)
    orders, remarks = _Orders(), []

    def opened() -> OpenBridge:
        return Bridge(config, drive=True, arm=True, wait=wait)

    with closing((open_bridge or opened)()) as bridge:
        orders.attend_to(bridge, attend)
        for seat in seats:
            seat.warm_up(bridge)
        try:
            for k in range(episodes):
                _drive_round(bridge, setting, seats, k, orders)
                if progress is not None:
                    progress((k + 1) / episodes)
        except KeyboardInterrupt:
            remarks.append("Interrupted")
        except BridgeError as error:
            if not all(seat.rounds for seat in seats):
                raise
            remarks.append(f"Ended early: {error}")
        finally:
            try:
                bridge.feed.order("quit")
            except BridgeError as error:
                remarks.append(str(error))
        remarks += [text for _, text in bridge.feed.notices if STOPPED in text]
    rounds = min(len(seat.rounds) for seat in seats)
    if rounds == 0:
        raise UsageError("nothing compared: it ended before every driver had driven once")
    return CompareResult(
        rows=tuple(seat.row(config, setting, rounds) for seat in seats),
        notes=tuple(notes),
        remarks=tuple(remarks),
        first_seed=1,
        seeds=rounds,
        errors_from="estimates",
    )


@dataclass(slots=True)
class _Seat:
    """A contender that can drive, and what it has driven."""

    contender: Contender
    trained_on: str | None
    history: int
    driver: Driver
    rounds: list[EpisodeResult] = field(default_factory=list)

    def env(self, bridge: OpenBridge, cycles: int = 1) -> HardwareFormationEnv:
        """The cars as it sees them; the last one that is made of a bridge is the one to use."""
        return bridge.env(
            observation=self.contender.observation, history=self.history, max_cycles=cycles
        )

    def warm_up(self, bridge: OpenBridge) -> None:
        """Load what is loaded when first used, while no car waits for a decision."""
        for space in self.env(bridge).observation_spaces.values():
            self.driver.act(np.zeros(space.shape, np.float32))

    def row(self, config: SwarmConfig, setting: Setting, rounds: int) -> Row:
        """Its complete rounds."""
        return Row(
            contender=self.contender,
            trained_on=self.trained_on,
            setting=setting,
            scenario=config.name,
            cars=config.n_slots,
            episodes=tuple(self.rounds[:rounds]),
        )


class _Orders:
    """What people ask for while it lasts."""

    def __init__(self) -> None:
        self._quit = False

    def attend_to(
        self, bridge: OpenBridge, attend: Callable[[Callable[[str], None]], None] | None
    ) -> None:
        """Let orders reach a bridge."""

        def take(what: str) -> None:
            self._quit |= what == "quit"
            bridge.start.heed(what)
            bridge.feed.order(what)

        if attend is not None:
            bridge.feed.attend = lambda: attend(take)
        bridge.start.attend = lambda: self._quit

    def check(self) -> None:
        """After every decision: end it all if that was asked for."""
        if self._quit:
            raise KeyboardInterrupt


def _drive_round(
    bridge: OpenBridge, setting: Setting, seats: Sequence[_Seat], k: int, orders: _Orders
) -> None:
    """One episode of every contender."""
    first = k % len(seats)
    for seat in (*seats[first:], *seats[:first]):
        driven = Driven(seat.env(bridge, setting.cycles), setting.cycles)
        try:
            seat.rounds += measure(driven, seat.driver, [k + 1], setting.first_scored, orders.check)
        finally:
            driven.close()


def _seat(
    drivers: Sequence[str], observations: Sequence[str], config: SwarmConfig
) -> tuple[list[_Seat], list[str]]:
    """All who can drive these cars, and why the others cannot."""
    seats, notes = [], []
    n_beams = config.task.proximity
    for contender in line_up(drivers, observations, n_beams):
        entry = find_entry(contender.name)
        if contender.observation == "truth":
            why: str | None = "real cars know no truth"
        elif entry.proximity is not None and entry.proximity != n_beams:
            why = f"expected {entry.proximity} beams, the cars have {n_beams}"
        else:
            why = entry.refusal(contender.observation, config.n_slots, n_beams)
        if why is not None:
            notes.append(f"{contender.label} in {config.name}: {why}")
            continue
        driver = entry.driver(contender.observation, config.n_slots, n_beams)
        seats.append(_Seat(contender, entry.trained_on, entry.history, driver))
    if not seats:
        raise UsageError("NAME: nothing to compare: " + "; ".join(notes))
    return seats, notes
