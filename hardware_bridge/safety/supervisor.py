"""The supervisor: the gate with its cars' drivers, pure; `process` gives it ports and a clock."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from hardware_bridge.drivers.base import CarDriver
from hardware_bridge.readings import Reading
from hardware_bridge.safety.believed import Believed
from hardware_bridge.safety.gate import Gate, GateOutput, reason_text
from hardware_bridge.safety.messages import Decision, Message, Notice, Order, Report, Word
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import Picture, blank_picture
from hardware_bridge.safety.telemetry import Telemetry
from tracking.arrays import F64, I64, Bool

NONE_KNOWN: Mapping[int, Any] = MappingProxyType({})
HALF_A_TICK = 0.005
"""[s]"""
LATE = 0.02
"""[s] A tick later than this is counted as missed."""


class Supervisor:
    """Holds the cars of one group to the rules, tick by tick."""

    def __init__(
        self,
        params: SafetyParams,
        n_cars: int,
        drivers: Mapping[int, CarDriver],
        names: Mapping[int, str],
        *,
        cells: Mapping[int, int] = NONE_KNOWN,
        watchdog: Mapping[int, float] = NONE_KNOWN,
        believed: Mapping[int, Believed] = NONE_KNOWN,
    ) -> None:
        """Begin with nothing armed.

        Args:
            params: Limits.
            n_cars: Slots.
            drivers: Of the slots that have a car.
            names: What each of these is called in notices.
            cells: Of the batteries of the slots where they are known.
            watchdog: Of the slots where it is known [s]; else it is `SafetyParams.deadman`.
            believed: Of the slots whose words are checked; of the others all are believed.
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
        self._drivers, self._names, self._believed = dict(drivers), dict(names), dict(believed)
        self._picture: Picture = blank_picture(1, n_cars)
        self._word = np.full(1, -np.inf)
        self._heard: F64 = np.full((1, n_cars), -np.inf)
        self._linked: Bool = np.zeros((1, n_cars), dtype=bool)
        self._now = np.full(1, -np.inf)
        self._output: GateOutput | None = None
        self._armed: Bool = np.zeros(n_cars, dtype=bool)
        self._late, self._missed = 0.0, 0
        self._lag, self._decided = 0.0, -np.inf
        self._ended = ""
        """Why it is over for all cars."""
        self._broken: dict[int, str] = {}
        self._told: dict[int, tuple[float, bool]] = {}
        """When each car was last told something, and whether it was to move."""
        self._taken: dict[int, float] = {}
        """When the port of each car last took what it was sent, or was lost [s]."""
        self._sent: list[int] = []
        """Slots that the last tick had something for."""
        self.quit = False
        """Asked to end."""

    def take(self, message: Message) -> list[Notice]:
        """A message from the deciding process; what of it the user should read."""
        match message:
            case Word(t, heard):
                self._word[0], self._heard[0] = t, heard
            case Decision(picture):
                # One that was overtaken by a later one, or is of no time, is not looked at.
                if picture.t[0] >= self._picture.t[0]:
                    self._picture = picture
                    self._word[0] = max(float(picture.t[0]), self._word[0])
            case Order("arm"):
                # Who has asked to end it does not begin again.
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

    def hear(self, slot: int, data: bytes, now: float) -> None:
        """Bytes that a car's controller sent [s]."""
        readings: Iterable[Reading] = self._drivers[slot].telemetry.feed(data)
        if slot in self._believed:
            readings = self._believed[slot].sift(readings, round(now * 1e9))
        self._telemetry.take(slot, readings, now)

    def abandon(self, why: str) -> None:
        """The deciding process is gone, or this one is ended: nothing will move again."""
        self._gate.stop()
        self.quit, self._ended = True, why

    def interrupt(self) -> None:
        """There was no supervision for longer than cars go on by themselves: they stand by now.

        Words and pictures of before may be of a time that no clock has counted.
        """
        self._gate.interrupt()
        self._taken.clear()  # ports took nothing, as nothing was sent

    def tick(self, now: float, late: float, linked: Sequence[int]) -> dict[int, bytes]:
        """What every car is sent now.

        After a pause in which cars have stopped by themselves, none moves until it is armed again.

        Args:
            now: [s]
            late: How late this tick is [s].
            linked: Slots of the cars whose port is open; in a dry run of all.

        Returns:
            Bytes by slot, for those with a car, whether its port is open or not. Of a driver that
            fails there are none: its car stops by itself, and the others are told as ever.
        """
        self._late, self._missed = max(late, self._late), self._missed + (late > LATE)
        if now - self._now[0] > self._gate.params.deadman and np.isfinite(self._now[0]):
            self.interrupt()
        self._linked[:] = False
        self._linked[0, [slot for slot in linked if self._is_linked(slot, now)]] = True
        for slot in self._drivers:
            self._taken[slot] = self._taken.get(slot, now) if slot in linked else now
        self._now[0] = now
        told = self._telemetry.told(now, self._gate.recent, self._gate.armed[0], self._linked[0])
        out = self._gate.step(self._picture, self._now, self._word, self._heard, self._linked, told)
        self._output = out
        said = {
            slot: self._bytes(slot, out) if self._is_due(slot, now, out) else b""
            for slot in self._drivers
        }
        self._sent = [slot for slot, data in said.items() if data]
        return said

    def _is_linked(self, slot: int, now: float) -> bool:
        """Whether commands of an open port leave; a car that hears none has stopped by itself."""
        if slot not in self._drivers:
            return True
        longest = self._gate.params.deadman + self._drivers[slot].gap
        return slot not in self._broken and now - self._taken.get(slot, now) <= longest

    def _is_due(self, slot: int, now: float, out: GateOutput) -> bool:
        """Whether a controller takes a command by now; the first that stops it is always due."""
        t, moved = self._told.get(slot, (-np.inf, True))
        moves = bool(out.moving[0, slot])
        due = now - t >= self._drivers[slot].gap - HALF_A_TICK or (moved and not moves)
        if due:
            self._told[slot] = now, moves
        return due

    def _bytes(self, slot: int, out: GateOutput) -> bytes:
        """What a car is sent; nothing where its driver cannot even say neutral."""
        driver = self._drivers[slot]
        if out.moving[0, slot]:
            try:
                return driver.drive(float(out.speed[0, slot]), float(out.steering[0, slot]))
            except Exception as error:  # whatever it is, the car must be told to stop
                self._broken[slot] = str(error)
        try:
            return driver.neutral()
        except Exception as error:
            self._broken[slot] = str(error)
            return b""

    def written(self, now: float, taken: Sequence[int]) -> None:
        """What the last tick asked for was handed to the ports.

        Args:
            now: [s]
            taken: Slots whose ports took it.
        """
        for slot in self._sent:
            if slot in taken:
                self._taken[slot] = now
                self._telemetry.sent(slot, self._drivers[slot].sequence - 1, now)
            else:
                self._told.pop(slot, None)  # it was not
        t = float(self._picture.t[0])
        if t > self._decided:
            self._decided, self._lag = t, now - t

    def stopped(self) -> list[Notice]:
        """Cars that were stopped for good since the last call, and why."""
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
        """What the gate did at the last tick."""
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
        # Well it is only after the next ticks, if its driver works again by then.
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
