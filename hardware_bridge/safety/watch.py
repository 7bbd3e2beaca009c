"""The loop of the supervisor's process: ports of cars, ticks, and what it is told."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from hardware_bridge.drivers import make_driver
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
from hardware_bridge.pauses import short_pauses
from hardware_bridge.safety.believed import Believed
from hardware_bridge.safety.charge import REPORT_EVERY, ROOM, TICK_NS, Charge
from hardware_bridge.safety.messages import (
    Decision,
    Message,
    Notice,
    Order,
    Ready,
    Telemetry,
    pack,
    unpack,
)
from hardware_bridge.safety.supervisor import Supervisor

LINGER = 30
"""[ticks] Neutral is sent so many times before the ports are closed."""


def supervise(charge: Charge, talk: socket.socket) -> None:
    """What the process does until it is told to quit or left alone.

    Args:
        charge: What it is responsible for.
        talk: Its end of the pair.
    """
    # What a terminal does to its processes, by keys or because it is closed, would reach both: the
    # deciding process says what is to be done, or is gone.
    with contextlib.suppress(OSError):
        os.setsid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    _hurry()
    with contextlib.suppress(OSError):  # for who looks at what has a port open
        Path("/proc/self/comm").write_text("relpos-gate")
    talk.setblocking(False)
    try:
        watch = _Watch(charge, talk)
    except BridgeError as error:
        talk.send(pack(Ready(str(error))))
        talk.close()
        return
    signal.signal(signal.SIGTERM, lambda *_: watch.abandon("the supervisor was ended"))
    try:
        with short_pauses():
            talk.send(pack(Ready()))
            watch.run()
    finally:
        watch.close()


class _Watch:
    """The supervisor with its ports, in its process."""

    def __init__(self, charge: Charge, talk: socket.socket) -> None:
        self._talk, self._n_cars, self._dry = talk, charge.n_cars, charge.dry
        self._deadman_ns = round(charge.params.deadman * 1e9)
        self._drivers = {
            slot: make_driver(car.driver, car.node, car.options, car.key, charge.boot, _now_us)
            for slot, car in charge.cars
        }
        self._slots = {car.port.name: slot for slot, car in charge.cars}
        self._supervisor = Supervisor(
            charge.params,
            charge.n_cars,
            self._drivers,
            {slot: car.port.name for slot, car in charge.cars},
            cells={slot: car.cells for slot, car in charge.cars},
            watchdog={slot: car.watchdog for slot, car in charge.cars if car.watchdog},
            believed={
                slot: Believed(car, charge.marks.get(car.port.name, {}))
                for slot, car in charge.cars
            },
        )
        specs = [car.port for _, car in charge.cars]
        self._links = Links(specs, time.monotonic_ns)
        for driver in self._drivers.values():
            driver.drive(0.0, 0.0)  # loads what is compiled; nothing is sent
        self._links.watch(talk.fileno())
        self._up: set[str] = set()
        self._asleep = asleep_ns()
        self._alone = False
        self._failed: set[tuple[str, str]] = set()

    def abandon(self, why: str) -> None:
        """Let the cars stand for good, and end."""
        self._supervisor.abandon(why)

    def run(self) -> None:
        """Tick after tick."""
        deadline, n_ticks, lingered = time.monotonic_ns() + TICK_NS, 0, 0
        while lingered < LINGER:
            left = deadline - time.monotonic_ns()
            for chunk in self._links.wait(max(left, 0) * 1e-9):
                slot = self._slots[chunk.link]
                self._supervisor.hear(slot, chunk.data, chunk.t_ns * 1e-9)
                self._say([Telemetry(self._slots[chunk.link], chunk.t_ns, chunk.data)])
            decided = self._listen()
            now = time.monotonic_ns()
            if now < deadline and not decided:
                continue
            late = max(now - deadline, 0)
            self._act(now, late * 1e-9)
            if now < deadline:
                continue
            n_ticks += 1
            # After a stop, the ticks of the past are not made up for.
            deadline = now + TICK_NS if late > TICK_NS else deadline + TICK_NS
            if n_ticks % REPORT_EVERY == 0:
                self._say([self._supervisor.report()])
                self._ask()
            lingered += self._supervisor.quit

    def close(self) -> None:
        """Let the cars stand, and release ports and socket."""
        for name, slot in self._slots.items():
            self._send(name, "neutral", self._drivers[slot].neutral)
        self._links.close()
        self._talk.close()

    def _act(self, now: int, late: float) -> None:
        """Tell every car what it may do now."""
        up = {name for name in self._slots if self._links.is_up(name)}
        for name in up - self._up:
            self._send(name, "greeting", self._drivers[self._slots[name]].opening)
        self._up = up
        asleep = asleep_ns()
        if asleep - self._asleep > self._deadman_ns:
            self._supervisor.interrupt()
        self._asleep = asleep
        linked = [*self._dry, *(self._slots[name] for name in up)]
        sent = self._supervisor.tick(now * 1e-9, late, linked)
        # Each by itself: one that fails keeps none of the others from being told.
        taken = [slot for name, slot in self._slots.items() if self._links.send(name, sent[slot])]
        self._supervisor.written(time.monotonic_ns() * 1e-9, taken)
        said: list[Message] = [
            Notice(f"{n.link} {'up' if n.up else f'down: {n.reason}'}")
            for n in self._links.drain_notices()
        ]
        self._say([*said, *self._supervisor.stopped()])

    def _ask(self) -> None:
        for name, slot in self._slots.items():
            self._send(name, "question", self._drivers[slot].ask)

    def _send(self, name: str, what: str, words: Callable[[], bytes]) -> None:
        """Let a driver speak; one that cannot is told of once, and keeps no other from it."""
        try:
            data = words()
            if data:
                self._links.send(name, data)
        except Exception as error:  # of whatever kind, the other cars must be told
            if (name, what) not in self._failed:
                self._failed.add((name, what))
                self._say([Notice(f"{name}: its driver cannot make the {what}: {error}")])

    def _listen(self) -> bool:
        """Take in what the deciding process said; whether a decision was among it."""
        decided = False
        while True:
            try:
                data = self._talk.recv(ROOM)
            except BlockingIOError:
                return decided
            except OSError:
                data = b""
            if not data:
                if self._alone:
                    return decided
                self._alone = True
                # It would be readable from here on.
                self._links.unwatch(self._talk.fileno())
                if not self._supervisor.quit:
                    self.abandon("the deciding process is gone")
                return True
            try:
                message = unpack(data, self._n_cars)
            except ValueError as error:
                self._say([Notice(f"supervisor: it was told what it cannot read, {error}")])
                continue
            decided |= isinstance(message, Decision | Order)
            self._say(self._supervisor.take(message))

    def _say(self, messages: Sequence[Message]) -> None:
        """Tell the deciding process; if it does not listen, so be it."""
        for message in messages:
            with contextlib.suppress(OSError):
                self._talk.send(pack(message))


def _now_us() -> int:
    return time.monotonic_ns() // 1000


def asleep_ns() -> int:
    """How long the computer was suspended since it started; 0 where no clock tells [ns].

    The monotonic clock stands still meanwhile, so that no time seems to have passed.
    """
    if not hasattr(time, "CLOCK_BOOTTIME"):
        return 0
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME) - time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def _hurry() -> None:
    """Ask for a place before other processes; without the right to, the default has to do."""
    with contextlib.suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, 0, -10)
    # It computes for a twentieth of the time at most, and those that it keeps waiting can wait.
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(10))
