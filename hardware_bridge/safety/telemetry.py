"""What the cars' own controllers say of themselves, as far as the gate looks at it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from hardware_bridge.readings import AckReading, MotionReading, Reading, StatusReading
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.recent import Recent
from tracking.arrays import F64, Bool

OLD = 0.5
"""[s] What a controller said so long ago of its speed is not looked at."""
SAG = 2.0
"""[s] Time constant of the mean voltage: a motor that starts lets it sag for a moment."""
STANDS, DRIVES = 0.05, 0.2
"""[m/s] A wheel as slow stands; a car that is asked for as much, and can go as slow, should not."""
MARGIN = 1.1
"""[-] Times the slowest that a car can go."""
COMMANDS = 1000
"""[-] Commands of each car whose answers are waited for; more than it is sent until it is deaf."""


class Told(NamedTuple):
    """Of every car, arrays over (env, car); harmless where a controller says nothing."""

    over_for: F64
    """Time for which it has been faster than it was ever asked to be [s]."""
    idle_for: F64
    """Time for which its wheels have stood although it is asked to drive [s]."""
    deaf_for: F64
    """Time since the newest command was sent that it answered, and since it told its speed, if it
    has ever done so [s]: what is sent to it may wait in a server on the way."""
    fault: Bool
    """Its controller has a fault."""
    cell: F64
    """Mean voltage of a cell of its battery [V]; infinite where it is not known."""
    watchdog: F64
    """Time after which it stops by itself when it hears nothing [s]."""


def nothing_told(shape: tuple[int, ...], params: SafetyParams) -> Told:
    """No controller says anything."""
    zero = np.zeros(shape)
    return Told(
        zero, zero, zero, np.zeros(shape, dtype=bool), np.full(shape, np.inf),
        np.full(shape, params.deadman),
    )  # fmt: skip


class Telemetry:
    """Takes readings, and knows since when something is wrong."""

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
        """Begin with nothing said.

        Args:
            params: Limits.
            n_cars: Slots.
            cells: Of each car's battery; 0 where its voltage is not looked at.
            watchdog: Of each car [s].
            answers: Whether its controller answers every command.
            slowest: Asked for less it stands, of each car [m/s].
        """
        self._params = params
        self._cells = np.array(cells, dtype=np.float64)
        self._watchdog = np.array(watchdog, dtype=np.float64)
        self._answers = np.array(answers, dtype=bool)
        self._drives = np.maximum(DRIVES, MARGIN * np.array(slowest, dtype=np.float64))
        self._sent: list[dict[int, float]] = [{} for _ in range(n_cars)]
        """When each command was sent that is not answered yet, by its number [s]."""
        self._speed = np.zeros(n_cars)
        self._said = np.full(n_cars, -np.inf)
        self._answered = np.full(n_cars, -np.inf)
        self._fault = np.zeros(n_cars, dtype=bool)
        self._volts = np.full(n_cars, np.nan)
        self._volts_at = np.full(n_cars, -np.inf)
        self._over_since = np.full(n_cars, np.inf)
        self._idle_since = np.full(n_cars, np.inf)

    def sent(self, slot: int, command: int, now: float) -> None:
        """A command was handed to a car's port, of this number [s]."""
        waiting = self._sent[slot]
        waiting[command] = now
        if len(waiting) > COMMANDS:
            del waiting[next(iter(waiting))]

    def take(self, slot: int, readings: Iterable[Reading], now: float) -> None:
        """What a car's controller said just now [s]."""
        for reading in readings:
            match reading:
                case MotionReading(speed=speed):
                    self._speed[slot], self._said[slot] = speed, now
                case AckReading(command=command):
                    # Of a command that it answers late it was told no sooner; it answers once.
                    then = self._sent[slot].pop(command, -np.inf)
                    self._answered[slot] = max(self._answered[slot], then)
                case StatusReading(voltage=voltage, fault=fault):
                    self._fault[slot] = fault != 0
                    if voltage is not None:
                        self._note_voltage(slot, voltage, now)

    def told(self, now: float, recent: Recent, moving: Bool, linked: Bool) -> Told:
        """What rules look at, of one environment.

        Args:
            now: [s]
            recent: What the cars may still be doing for what they were sent.
            moving: Whether they were let drive, (car).
            linked: Whether their ports are open, (car).
        """
        p, fresh = self._params, now - self._said <= OLD
        forward, backward = recent.forward[0], recent.backward[0]
        beyond = np.maximum(self._speed - forward, -self._speed - backward) > p.runaway_speed
        self._over_since = _since(self._over_since, fresh & beyond, now)
        stands = fresh & (np.abs(self._speed) < STANDS)
        idle = moving & stands & (np.abs(recent.speed[0]) >= self._drives)
        self._idle_since = _since(self._idle_since, idle, now)
        # It may answer from when its port is open on.
        self._answered = np.where(linked & np.isfinite(self._answered), self._answered, now)
        known = np.isfinite(self._volts) & (self._cells > 0.0)
        cell = np.where(known, self._volts / np.maximum(self._cells, 1.0), np.inf)
        return Told(
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
    """Since when something has been so; infinite where it is not."""
    return np.where(is_so, np.minimum(since, now), np.inf)
