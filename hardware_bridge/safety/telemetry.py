"""Telemetry of the cars' controllers, as used by the gate."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from hardware_bridge.readings import AckReading, MotionReading, Reading, StatusReading
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.recent import Recent
from tracking.arrays import F64, Bool

OLD = 0.5
"""[s] Age from which a reported speed is ignored."""
SAG = 2.0
"""[s] Time constant of the mean voltage, since a starting motor lets it sag for a moment."""
REST_SPEED, DRIVES = 0.05, 0.2
"""[m/s] A car slower than the first speed is at rest; commands from the second on must move it."""
MARGIN = 1.1
"""[-] Factor on a car's lowest speed; smaller commands need not move it."""
COMMANDS = 1000
"""[-] Number of unanswered commands kept per car; more than are sent within `answer_time`."""


class TelemetryState(NamedTuple):
    """Telemetry of every car, arrays over (env, car); without effect where none is received."""

    over_for: F64
    """[s] Time for which the car has been faster than its commands explain."""
    idle_for: F64
    """[s] Time for which the wheels have been at rest despite a command to drive."""
    deaf_for: F64
    """[s] Time since the newest acknowledged command was sent, or since the last speed report if
    there was one; the larger of both. Commands may wait in a server on the way."""
    fault: Bool
    """True if the controller reports a fault."""
    cell: F64
    """[V] Mean voltage of a battery cell; infinite if unknown."""
    watchdog: F64
    """[s] Time without commands after which the car stops by itself."""


def no_telemetry(shape: tuple[int, ...], params: SafetyParams) -> TelemetryState:
    """Return the values for cars without telemetry."""
    zero = np.zeros(shape)
    return TelemetryState(
        zero, zero, zero, np.zeros(shape, dtype=bool), np.full(shape, np.inf),
        np.full(shape, params.deadman),
    )  # fmt: skip


class Telemetry:
    """Evaluation of the controllers' readings: start times of faults, and voltages."""

    def __init__(
        self,
        params: SafetyParams,
        n_cars: int,
        *,
        cells: Sequence[int],
        watchdog: Sequence[float],
        answers: Sequence[bool],
        slowest: Sequence[float],
    ) -> None:
        """Create an evaluation without readings.

        Args:
            params: Limits.
            n_cars: Number of slots.
            cells: Number of battery cells of each car; 0 to ignore its voltage.
            watchdog: Watchdog time of each car [s].
            answers: True if the controller acknowledges every command.
            slowest: Lowest speed of each car; it stops at smaller commands [m/s].
        """
        self._params = params
        self._cells = np.array(cells, dtype=np.float64)
        self._watchdog = np.array(watchdog, dtype=np.float64)
        self._answers = np.array(answers, dtype=bool)
        self._drives = np.maximum(DRIVES, MARGIN * np.array(slowest, dtype=np.float64))
        self._sent: list[dict[int, float]] = [{} for _ in range(n_cars)]
        """Time at which each unacknowledged command was sent, by its number [s]."""
        self._speed = np.zeros(n_cars)
        self._said = np.full(n_cars, -np.inf)
        self._answered = np.full(n_cars, -np.inf)
        self._fault = np.zeros(n_cars, dtype=bool)
        self._volts = np.full(n_cars, np.nan)
        self._volts_at = np.full(n_cars, -np.inf)
        self._over_since = np.full(n_cars, np.inf)
        self._idle_since = np.full(n_cars, np.inf)

    def sent(self, slot: int, command: int, now: float) -> None:
        """Record the number of a command and the time `now` [s] at which a car's port took it."""
        waiting = self._sent[slot]
        waiting[command] = now
        if len(waiting) > COMMANDS:
            del waiting[next(iter(waiting))]

    def take(self, slot: int, readings: Iterable[Reading], now: float) -> None:
        """Process readings that a car's controller sent at time `now` [s]."""
        for reading in readings:
            match reading:
                case MotionReading(speed=speed):
                    self._speed[slot], self._said[slot] = speed, now
                case AckReading(command=command):
                    # An answer counts from the sending of its command, which has only one.
                    then = self._sent[slot].pop(command, -np.inf)
                    self._answered[slot] = max(self._answered[slot], then)
                case StatusReading(voltage=voltage, fault=fault):
                    self._fault[slot] = fault != 0
                    if voltage is not None:
                        self._note_voltage(slot, voltage, now)

    def state(self, now: float, recent: Recent, moving: Bool, linked: Bool) -> TelemetryState:
        """Return the input of the rules, of one environment.

        Args:
            now: Current time [s].
            recent: Bounds of the cars' motion given the commands sent so far.
            moving: True for cars permitted to drive, (car).
            linked: True for cars with an open port, (car).
        """
        p, fresh = self._params, now - self._said <= OLD
        forward, backward = recent.forward[0], recent.backward[0]
        beyond = np.maximum(self._speed - forward, -self._speed - backward) > p.runaway_speed
        self._over_since = _since(self._over_since, fresh & beyond, now)
        at_rest = fresh & (np.abs(self._speed) < REST_SPEED)
        idle = moving & at_rest & (np.abs(recent.speed[0]) >= self._drives)
        self._idle_since = _since(self._idle_since, idle, now)
        # Answers are expected from the opening of the port on.
        self._answered = np.where(linked & np.isfinite(self._answered), self._answered, now)
        known = np.isfinite(self._volts) & (self._cells > 0.0)
        cell = np.where(known, self._volts / np.maximum(self._cells, 1.0), np.inf)
        return TelemetryState(
            np.maximum(now - self._over_since, 0.0)[None],
            np.maximum(now - self._idle_since, 0.0)[None],
            np.maximum(
                np.where(self._answers, now - self._answered, 0.0),
                np.where(linked & np.isfinite(self._said), now - self._said, 0.0),
            )[None],
            self._fault[None].copy(),
            cell[None],
            self._watchdog[None],
        )

    def _note_voltage(self, slot: int, voltage: float, now: float) -> None:
        elapsed = now - self._volts_at[slot]
        share = 1.0 if np.isnan(self._volts[slot]) else elapsed / (SAG + elapsed)
        before = np.nan_to_num(self._volts[slot])
        self._volts[slot] = before + share * (voltage - before)
        self._volts_at[slot] = now


def _since(since: F64, is_so: Bool, now: float) -> F64:
    """Return the start of a condition that holds; infinite where it does not hold."""
    return np.where(is_so, np.minimum(since, now), np.inf)
