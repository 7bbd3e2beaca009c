"""How a drive begins: all is well, the cars are armed, and they find out where the others are.

While they stand, ranges leave open how the group is turned or mirrored. So at first every car
wriggles within 0.4 m of its place (three cars), each in its own rhythm, until the trackers
are sure; only then is it asked for anything. Every car ends where it began, and pointing as it
did: cars that were put down in a formation are still in it, and not turned towards a wall.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hardware_bridge.config.swarm import SwarmConfig
from hardware_bridge.drivers import make_driver
from hardware_bridge.errors import BridgeError
from hardware_bridge.live.group import LiveGroup
from hardware_bridge.safety.gate import reason_text
from hardware_bridge.safety.messages import Report
from relpos_env.timing import DECISION
from tracking.arrays import F64, Bool


@dataclass(frozen=True, slots=True, kw_only=True)
class StartParams:
    """Of a start."""

    wait: float = 60.0
    """[s] For all to be well; cars that cannot be armed for so long end it."""
    find: float = 30.0
    """[s] For cars to find each other; then the drive begins as it is, once all are home."""
    sure: float = 1.0
    """[s] All places must have been known for so long."""
    speed: float = 0.3
    """[m/s] Of the wriggling."""
    steering: float = 0.4
    """[rad] Of the wriggling."""
    period: float = 1.6
    """[s] Forwards and back of the first car; the others take longer by fifths of it."""


class Gated(Protocol):
    """Something with a gate at its end: ports and a supervisor, or both in memory."""

    report: Report | None
    """What the gate did, the latest; None before the first word from it."""

    def order(self, what: str) -> None:
        """Pass on what a person asks for; see `Order`."""

    def note(self, t_ns: int, text: str) -> None:
        """Let the user have a line."""


class Start:
    """Arms the cars and lets them find each other."""

    def __init__(self, feed: Gated, *, arm: bool, params: StartParams | None = None) -> None:
        """Prepare for a start.

        Args:
            feed: Of the cars' gate.
            arm: Whether cars may move; otherwise nothing is done and nothing waited for.
            params: How long, and how they wriggle.
        """
        self._feed, self._arm = feed, arm
        self._params = params or StartParams()
        self.attend: Callable[[], bool] | None = None
        """Called after every decision; True ends it all with KeyboardInterrupt."""
        self._held = False
        self._armed_once = False

    def heed(self, what: str) -> None:
        """Take note of what a person has ordered: who has said stop arms the cars, too."""
        self._held = what != "arm" and (self._held or what in ("stop", "disarm", "clear"))

    def run(self, group: LiveGroup) -> None:
        """Do what is to be done before a drive.

        Args:
            group: Of the cars, begun.

        Raises:
            BridgeError: The cars could not be armed.
        """
        if not self._arm:
            return
        self._get_armed(group)
        self._find(group)

    def _get_armed(self, group: LiveGroup) -> None:
        """Let the cars stand and listen until all is well, and arm them.

        By itself only the first start arms them. Cars that were stopped later wait for a person.
        """
        config, feed = group.swarm.config, self._feed
        slots = [config.slot_of(car) for car in config.cars]
        still = np.zeros((1, config.n_slots))
        asked = False
        for _ in range(round(self._params.wait / DECISION)):
            self._step(group, still, still)
            report = feed.report
            if report is None:
                continue
            if report.armed[slots].all():
                self._armed_once = True
                return
            well = bool((report.well_for[slots] > config.safety.health).all())
            well = well and self._rates_fit(group, slots)
            if self._armed_once:
                if not asked:
                    feed.note(group.t_ns, "stopped cars wait to be armed by a person")
                    asked = True
            elif well and not (self._held or report.emergency):
                feed.order("arm")
        if feed.report is None:
            raise BridgeError("supervisor: no word from it")
        if self._armed_once:
            raise BridgeError(
                f"cars: not armed within {self._params.wait:g} s; they were stopped in the episode "
                "before, and only a person arms them again"
            )
        if self._held:
            raise BridgeError(
                f"cars: not armed within {self._params.wait:g} s, since a key had stopped or "
                "disarmed them, and none has armed them"
            )
        raise BridgeError(f"{self._unwell(group, slots)}; see `relpos doctor`")

    def _unwell(self, group: LiveGroup, slots: list[int]) -> str:
        """Which node or car was not well all the time, and why; a silent node holds all."""
        report, swarm = self._feed.report, group.swarm
        assert report is not None
        ids, wait = swarm.group.ids, f"not well within {self._params.wait:g} s"
        heard = swarm.heard()
        silent = [k for k in range(len(heard)) if not np.isfinite(heard[k])]
        if silent:
            return f"node {ids[silent[0]]}: {wait}: it was not heard"
        # A car that is only not armed waits for another.
        unwell = [k for k in slots if not report.well_for[k] > swarm.config.safety.health]
        slot = next(iter(unwell), next((k for k in slots if not report.armed[k]), slots[0]))
        return f"cars.{ids[slot]}: {wait}: {reason_text(int(report.reason[slot]))}"

    def _rates_fit(self, group: LiveGroup, slots: list[int]) -> bool:
        """Whether it is known that samples come as often as configured.

        Raises:
            BridgeError: Those of a car do not, or read at rest what no IMU does.
        """
        swarm = group.swarm
        if swarm.config.tracker.source == "positions":
            return True
        rates = swarm.intake.sample_rates
        for slot in slots:
            if slot in swarm.intake.at_rest.wrong:
                raise BridgeError(swarm.intake.at_rest.wrong[slot])
            if rates.is_off(slot):
                raise BridgeError(swarm.intake.wrong_rate(slot))
        return not any(rates.is_open(slot) for slot in slots)

    def _find(self, group: LiveGroup) -> None:
        """Let the cars wriggle until all know where the others are."""
        p, n = self._params, group.swarm.config.n_slots
        known, k, home = 0.0, 0, np.zeros(n, dtype=bool)
        while not home.all():
            known = known + DECISION if group.believed.complete else 0.0
            t = k * DECISION
            if home.any() or known >= p.sure or t >= p.find:
                home |= is_home(p, n, t)
            speed, steering = wriggle(p, n, t)
            self._step(group, np.where(home, 0.0, speed), np.where(home, 0.0, steering))
            k += 1
        still = np.zeros((1, n))
        for _ in range(round(0.5 / DECISION)):
            self._step(group, still, still)

    def _step(self, group: LiveGroup, speed: F64, steering: F64) -> None:
        group.step(speed, steering)
        if self.attend is not None and self.attend():
            raise KeyboardInterrupt


def check_pace(config: SwarmConfig, params: StartParams | None = None) -> None:
    """Refuse cars that cannot drive as slowly as a start asks for, before anything is opened.

    Args:
        config: Of the swarm.
        params: How it starts.

    Raises:
        BridgeError: Names the first car that would stand, and what to change.
    """
    if config.tracker.source == "positions":
        return  # where the others are is known without moving
    asked = min((params or StartParams()).speed, config.safety.slow)
    for car in config.cars:
        driver = make_driver(car.driver, car.node, car.options, car.key, 0, lambda: 0)
        if driver.slowest > asked:
            raise BridgeError(
                f"cars.{car.node}.options: slower than {driver.slowest:.2g} m/s it stands, and at "
                f"the start cars find each other at {asked:g} m/s; teach it to drive slower, or "
                "raise slow of [safety] if that limits it"
            )


def check_watchdogs(config: SwarmConfig) -> None:
    """Refuse cars of which it is not known when they stop by themselves.

    Raises:
        BridgeError: Names the first of them.
    """
    for car in config.cars:
        if car.watchdog is None:
            raise BridgeError(
                f"cars.{car.node}.watchdog: missing, expected the seconds after which it stops by "
                "itself; measure them with `relpos doctor --watchdog`, its wheels off the ground"
            )


def wriggle(p: StartParams, n_cars: int, t: float) -> tuple[F64, F64]:
    """Speeds and steering angles that keep cars near their places.

    Args:
        p: How they wriggle.
        n_cars: How many.
        t: Since it began [s].

    Returns:
        Speed [m/s] and steering [rad], each (1, car).
    """
    k = np.arange(n_cars)
    turns = t / _periods(p, n_cars)
    speed = p.speed * np.where(np.sin(2.0 * np.pi * turns + 2.1 * k) >= 0.0, 1.0, -1.0)
    # The wheels stay turned to one side while the car goes forwards and back: it retraces its arc,
    # and is where it was.
    side = np.floor(turns + 1e-9).astype(int) + k
    steering = p.steering * np.where(side % 2 == 0, 1.0, -1.0)
    return speed[None], steering[None]


def is_home(p: StartParams, n_cars: int, t: float) -> Bool:
    """Whether cars that wriggle are where they began, to the nearest decision.

    Args:
        p: How they wriggle.
        n_cars: How many.
        t: Since it began [s].

    Returns:
        (car)
    """
    periods = _periods(p, n_cars)
    off = np.abs(t - np.round(t / periods) * periods)
    home: Bool = off <= 0.5 * DECISION + 1e-9
    return home


def _periods(p: StartParams, n_cars: int) -> F64:
    """Forwards and back, (car) [s]."""
    return np.array([p.period * (1.0 + 0.2 * k) for k in range(n_cars)], dtype=np.float64)
