"""Start-up of a drive: arm the cars, then excite the tracker until relative positions are known.

At rest, ranges do not determine the rotation and reflection of the group. At first every car
therefore drives back and forth within 0.4 m of its start (three cars), with its own period, until
the trackers are certain; only then the drive begins. Every car ends at its start pose: cars placed
in a formation remain in it and do not turn towards a wall.
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
    """Parameters of the start-up."""

    wait: float = 60.0
    """[s] Longest wait until all cars are armed; then the start-up fails. For a car that decides
    alone it is also the longest excitation, since the others may start later."""
    find: float = 30.0
    """[s] Longest excitation; then the drive begins once all cars are back at their start."""
    sure: float = 1.0
    """[s] Time for which all positions must have been known."""
    speed: float = 0.3
    """[m/s] Speed of the excitation."""
    steering: float = 0.4
    """[rad] Steering angle of the excitation."""
    period: float = 1.6
    """[s] Period of the excitation of the first car; that of car k is 1 + 0.2 k times as long."""


class Gated(Protocol):
    """A feed with a gate: ports and a supervisor, or both in memory."""

    report: Report | None
    """Latest report of the gate; None before the first."""

    def order(self, what: str) -> None:
        """Forward an operator command; see `Order`."""

    def note(self, t_ns: int, text: str) -> None:
        """Show a line of text to the user."""


class Start:
    """Arms the cars and excites the tracker."""

    def __init__(self, feed: Gated, *, arm: bool, params: StartParams | None = None) -> None:
        """Prepare a start-up.

        Args:
            feed: Feed with the cars' gate.
            arm: True if cars may move; otherwise the start-up does nothing.
            params: Durations and excitation.
        """
        self._feed, self._arm = feed, arm
        self._params = params or StartParams()
        self.attend: Callable[[], bool] | None = None
        """Called after every control step; True ends the run with KeyboardInterrupt."""
        self._held = False
        self._armed_once = False

    def heed(self, what: str) -> None:
        """Record an operator command; a stop, disarm or clear prevents automatic arming."""
        self._held = what != "arm" and (self._held or what in ("stop", "disarm", "clear"))

    def run(self, group: LiveGroup) -> None:
        """Run the start-up before a drive.

        Args:
            group: Group of the cars, after `begin`.

        Raises:
            BridgeError: The cars could not be armed.
        """
        if not self._arm:
            return
        self._get_armed(group)
        self._find(group)

    def _get_armed(self, group: LiveGroup) -> None:
        """Keep the cars at rest until they have been healthy for long enough, and arm them.

        Only the first start-up arms automatically; cars stopped later wait for an operator.
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
        """Return the node or car that was not healthy, and why; a silent node blocks all cars."""
        report, swarm = self._feed.report, group.swarm
        assert report is not None
        ids, wait = swarm.group.ids, f"not well within {self._params.wait:g} s"
        t_last_message = swarm.t_last_message()
        silent = [k for k in range(len(t_last_message)) if not np.isfinite(t_last_message[k])]
        if silent:
            return f"node {ids[silent[0]]}: {wait}: no message was received"
        # A healthy car that is not armed waits for another one.
        unwell = [k for k in slots if not report.well_for[k] > swarm.config.safety.health]
        slot = next(iter(unwell), next((k for k in slots if not report.armed[k]), slots[0]))
        return f"cars.{ids[slot]}: {wait}: {reason_text(int(report.reason[slot]))}"

    def _rates_fit(self, group: LiveGroup, slots: list[int]) -> bool:
        """Return whether sample rates are known and as configured.

        Raises:
            BridgeError: A car's rate differs, or its IMU's readings at rest are impossible.
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
        """Run the excitation until all positions are known and all cars are back at their start."""
        p, config = self._params, group.swarm.config
        n, alone = config.n_slots, config.alone is not None
        known, k, home = 0.0, 0, np.zeros(n, dtype=bool)
        # The others begin when their own computers do.
        longest = p.wait if alone else p.find
        is_ours = np.full(n, not alone)
        is_ours[[config.slot_of(car) for car in config.cars]] = True
        while not home[is_ours].all():
            known = known + DECISION if group.estimated.complete else 0.0
            t = k * DECISION
            if home[is_ours].any() or known >= p.sure or t >= longest:
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
    """Refuse cars that cannot drive as slowly as the start-up requires, before opening any port.

    Args:
        config: Configuration of the swarm.
        params: Parameters of the start-up.

    Raises:
        BridgeError: Names the first car with too high a lowest speed, and the remedy.
    """
    if config.tracker.source == "positions":
        return  # positions are known without motion
    asked = min((params or StartParams()).speed, config.safety.slow)
    for car in config.cars:
        driver = make_driver(car.driver, car.node, car.options, car.key, 0, lambda: 0)
        if driver.slowest > asked:
            raise BridgeError(
                f"cars.{car.node}.options: slower than {driver.slowest:.2g} m/s it stops, and at "
                f"the start cars find each other at {asked:g} m/s; teach it to drive slower, or "
                "raise slow of [safety] if that limits it"
            )


def check_watchdogs(config: SwarmConfig) -> None:
    """Refuse cars without a configured watchdog time.

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
    """Return excitation commands that keep cars near their start.

    Args:
        p: Parameters of the excitation.
        n_cars: Number of cars.
        t: Time since its start [s].

    Returns:
        Speed [m/s] and steering [rad], each (1, car).
    """
    k = np.arange(n_cars)
    turns = t / _periods(p, n_cars)
    speed = p.speed * np.where(np.sin(2.0 * np.pi * turns + 2.1 * k) >= 0.0, 1.0, -1.0)
    # The steering angle is constant during a forward and backward run: the car retraces its arc
    # back to its start.
    side = np.floor(turns + 1e-9).astype(int) + k
    steering = p.steering * np.where(side % 2 == 0, 1.0, -1.0)
    return speed[None], steering[None]


def is_home(p: StartParams, n_cars: int, t: float) -> Bool:
    """Return whether cars in excitation are at their start, to the nearest control step.

    Args:
        p: Parameters of the excitation.
        n_cars: Number of cars.
        t: Time since its start [s].

    Returns:
        True for cars at their start, (car).
    """
    periods = _periods(p, n_cars)
    off = np.abs(t - np.round(t / periods) * periods)
    home: Bool = off <= 0.5 * DECISION + 1e-9
    return home


def _periods(p: StartParams, n_cars: int) -> F64:
    """Return the periods of the cars' excitation, (car) [s]."""
    return np.array([p.period * (1.0 + 0.2 * k) for k in range(n_cars)], dtype=np.float64)
