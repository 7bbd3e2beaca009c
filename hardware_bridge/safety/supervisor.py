"""The supervisor: the gate with its cars' drivers, pure; `process` adds ports and a clock."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from hardware_bridge.drivers.base import CarDriver
from hardware_bridge.readings import Reading
from hardware_bridge.safety.gate import Gate, GateOutput, reason_text
from hardware_bridge.safety.message_filter import MessageFilter
from hardware_bridge.safety.messages import Decision, Message, Notice, Order, Report, Word
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import Picture, blank_picture
from hardware_bridge.safety.telemetry import Telemetry
from tracking.arrays import F64, I64, Bool

NONE_KNOWN: Mapping[int, Any] = MappingProxyType({})
HALF_A_TICK = 0.005
"""[s] Tolerance of the interval between commands."""
LATE = 0.02
"""[s] Delay above which a tick counts as missed."""


class Supervisor:
    """Applies the rules to the cars of one group, tick by tick."""

    def __init__(
        self,
        params: SafetyParams,
        n_cars: int,
        drivers: Mapping[int, CarDriver],
        names: Mapping[int, str],
        *,
        cells: Mapping[int, int] = NONE_KNOWN,
        watchdog: Mapping[int, float] = NONE_KNOWN,
        message_filters: Mapping[int, MessageFilter] = NONE_KNOWN,
    ) -> None:
        """Create a supervisor with no car armed.

        Args:
            params: Limits.
            n_cars: Slots.
            drivers: Driver of each slot that has a car.
            names: Name of each of these slots in notices.
            cells: Number of battery cells of each slot where it is known.
            watchdog: Watchdog time of each slot [s]; default: `SafetyParams.deadman`.
            message_filters: Message filter of each slot; without one all messages are accepted.
        """
        slots = range(n_cars)
        self._telemetry = Telemetry(
            params,
            n_cars,
            cells=[cells.get(k, 0) for k in slots],
            watchdog=[watchdog.get(k, params.deadman) for k in slots],
            answers=[k in drivers and drivers[k].answers for k in slots],
            slowest=[drivers[k].slowest if k in drivers else 0.0 for k in slots],
        )
        self._gate = Gate(params, 1, n_cars)
        self._drivers, self._names = dict(drivers), dict(names)
        self._message_filters = dict(message_filters)
        self._picture: Picture = blank_picture(1, n_cars)
        self._word = np.full(1, -np.inf)
        self._t_last_message: F64 = np.full((1, n_cars), -np.inf)
        self._linked: Bool = np.zeros((1, n_cars), dtype=bool)
        self._now = np.full(1, -np.inf)
        self._output: GateOutput | None = None
        self._armed: Bool = np.zeros(n_cars, dtype=bool)
        self._late, self._missed = 0.0, 0
        self._lag, self._decided = 0.0, -np.inf
        self._ended = ""
        """Reason for the end of the run, for all cars."""
        self._broken: dict[int, str] = {}
        self._last_command: dict[int, tuple[float, bool]] = {}
        """Time of each car's last command, and whether it was one to move."""
        self._taken: dict[int, float] = {}
        """Time at which each car's port last took its command, or was lost [s]."""
        self._sent: list[int] = []
        """Slots with a command in the last tick."""
        self.quit = False
        """True once the supervisor is to end."""

    def take(self, message: Message) -> list[Notice]:
        """Process a message of the deciding process; return notices for the user."""
        match message:
            case Word(t, t_last_message):
                self._word[0], self._t_last_message[0] = t, t_last_message
            case Decision(picture):
                # Outdated snapshots and those without a valid time are ignored.
                if picture.t[0] >= self._picture.t[0]:
                    self._picture = picture
                    self._word[0] = max(float(picture.t[0]), self._word[0])
            case Order("arm"):
                # No arming after quit.
                return [] if self.quit else self._arm()
            case Order("disarm"):
                self._gate.disarm()
            case Order("stop"):
                self._gate.stop()
                return [Notice("emergency stop")]
            case Order("clear"):
                self._gate.clear()
            case Order("quit"):
                self._gate.disarm()
                self.quit = True
            case Order(what):
                return [Notice(f"unknown order {what!r}")]
        return []

    def receive(self, slot: int, data: bytes, now: float) -> None:
        """Process bytes that a car's controller sent at time `now` [s]."""
        readings: Iterable[Reading] = self._drivers[slot].telemetry.feed(data)
        if slot in self._message_filters:
            readings = self._message_filters[slot].sift(readings, round(now * 1e9))
        self._telemetry.take(slot, readings, now)

    def abandon(self, why: str) -> None:
        """Stop all cars permanently: the deciding process is gone or this one is ended."""
        self._gate.stop()
        self.quit, self._ended = True, why

    def interrupt(self) -> None:
        """Disarm all cars after a pause longer than `deadman`: they have stopped by themselves.

        Earlier heartbeats and snapshots may be older than the clock says.
        """
        self._gate.interrupt()
        self._taken.clear()  # nothing was sent during the pause

    def tick(self, now: float, late: float, linked: Sequence[int]) -> dict[int, bytes]:
        """Return the command of every car.

        After a pause in which cars have stopped by themselves, none moves until it is armed again.

        Args:
            now: Current time [s].
            late: Delay of this tick [s].
            linked: Slots of the cars with an open port; in a dry run of all.

        Returns:
            Bytes by slot for all cars, also without an open port. A driver that fails yields none:
            its car stops by itself, and the others get their commands.
        """
        self._late, self._missed = max(late, self._late), self._missed + (late > LATE)
        if now - self._now[0] > self._gate.params.deadman and np.isfinite(self._now[0]):
            self.interrupt()
        self._linked[:] = False
        self._linked[0, [slot for slot in linked if self._is_linked(slot, now)]] = True
        for slot in self._drivers:
            self._taken[slot] = self._taken.get(slot, now) if slot in linked else now
        self._now[0] = now
        telemetry = self._telemetry.state(
            now, self._gate.recent, self._gate.armed[0], self._linked[0]
        )
        out = self._gate.step(
            self._picture, self._now, self._word, self._t_last_message, self._linked, telemetry
        )
        self._output = out
        said = {
            slot: self._bytes(slot, out) if self._is_due(slot, now, out) else b""
            for slot in self._drivers
        }
        self._sent = [slot for slot, data in said.items() if data]
        return said

    def _is_linked(self, slot: int, now: float) -> bool:
        """Return whether commands reach the car; without commands it has stopped by itself."""
        if slot not in self._drivers:
            return True
        longest = self._gate.params.deadman + self._drivers[slot].gap
        return slot not in self._broken and now - self._taken.get(slot, now) <= longest

    def _is_due(self, slot: int, now: float, out: GateOutput) -> bool:
        """Return whether a command is due, and note it; the first stop command always is."""
        t, moved = self._last_command.get(slot, (-np.inf, True))
        moves = bool(out.moving[0, slot])
        due = now - t >= self._drivers[slot].gap - HALF_A_TICK or (moved and not moves)
        if due:
            self._last_command[slot] = now, moves
        return due

    def _bytes(self, slot: int, out: GateOutput) -> bytes:
        """Return the command of a car; empty if its driver cannot encode neutral either."""
        driver = self._drivers[slot]
        if out.moving[0, slot]:
            try:
                return driver.drive(float(out.speed[0, slot]), float(out.steering[0, slot]))
            except Exception as error:  # of any kind: the car must get a stop command
                self._broken[slot] = str(error)
        try:
            return driver.neutral()
        except Exception as error:
            self._broken[slot] = str(error)
            return b""

    def written(self, now: float, taken: Sequence[int]) -> None:
        """Record that the commands of the last tick were passed to the ports.

        Args:
            now: Current time [s].
            taken: Slots whose ports took the command.
        """
        for slot in self._sent:
            if slot in taken:
                self._taken[slot] = now
                self._telemetry.sent(slot, self._drivers[slot].sequence - 1, now)
            else:
                self._last_command.pop(slot, None)  # not sent
        t = float(self._picture.t[0])
        if t > self._decided:
            self._decided, self._lag = t, now - t

    def stopped(self) -> list[Notice]:
        """Return notices of the cars disarmed since the last call, with reasons."""
        assert self._output is not None
        armed, reason = self._output.armed[0], self._output.reason[0]
        lost = np.flatnonzero(self._armed & ~armed)
        self._armed = armed.copy()
        return [Notice(f"{self._names[k]} stopped: {self._why(k, reason)}") for k in lost.tolist()]

    def _why(self, slot: int, reason: I64) -> str:
        broken = self._broken.get(slot)
        if broken is not None:
            return f"its driver failed: {broken}"
        return self._ended or reason_text(int(reason[slot]))

    def report(self) -> Report:
        """Return the state and output of the gate at the last tick."""
        assert self._output is not None
        out = self._output
        report = Report(
            t=float(self._now[0]),
            speed=out.speed[0],
            steering=out.steering[0],
            cap=out.cap[0],
            armed=out.armed[0].astype(np.float64),
            linked=self._linked[0].astype(np.float64),
            reason=out.reason[0].astype(np.float64),
            well_for=self._gate.well_for(self._now)[0],
            emergency=bool(self._gate.emergency[0]),
            late=self._late,
            missed=self._missed,
            lag=self._lag,
        )
        self._late = 0.0
        return report

    def _arm(self) -> list[Notice]:
        # A failed driver gets another try: its car counts as linked again from the next tick on.
        self._broken.clear()
        cars = np.zeros_like(self._linked)
        cars[0, list(self._drivers)] = True
        armed = self._gate.arm(self._now, cars)
        self._armed = armed[0].copy()
        refused = np.flatnonzero(cars[0] & ~armed[0]).tolist()
        if self._gate.emergency[0]:
            return [Notice("not armed: emergency stop, clear it first")]
        why = self._output.reason[0] if self._output is not None else np.full(len(armed[0]), -2)
        return [
            Notice(
                f"{self._names[k]} not armed: {reason_text(int(why[k]))}; "
                f"all must be well for {self._gate.params.health:g} s"
            )
            for k in refused
        ]
