"""Main loop of the supervisor process: ports of cars, ticks and messages."""

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
from hardware_bridge.safety.charge import REPORT_EVERY, ROOM, TICK_NS, Charge
from hardware_bridge.safety.message_filter import MessageFilter
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
"""[ticks] Number of ticks with neutral commands before the ports are closed."""


def supervise(charge: Charge, talk: socket.socket) -> None:
    """Run the supervisor process until it is ordered to quit or the deciding process is gone.

    Args:
        charge: Configuration of the supervisor.
        talk: The supervisor's end of the socket pair.
    """
    # Signals of the terminal, from keys or its closing, would reach both processes; here they are
    # ignored, since the deciding process sends orders or ends.
    with contextlib.suppress(OSError):
        os.setsid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    _hurry()
    with contextlib.suppress(OSError):  # name shown by tools that list open ports
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
    """The supervisor with its ports."""

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
            message_filters={
                slot: MessageFilter(car, charge.marks.get(car.port.name, {}))
                for slot, car in charge.cars
            },
        )
        specs = [car.port for _, car in charge.cars]
        self._links = Links(specs, time.monotonic_ns)
        for driver in self._drivers.values():
            driver.drive(0.0, 0.0)  # loads compiled code; nothing is sent
        self._links.watch(talk.fileno())
        self._up: set[str] = set()
        self._asleep = asleep_ns()
        self._alone = False
        self._failed: set[tuple[str, str]] = set()

    def abandon(self, why: str) -> None:
        """Stop the cars permanently, and end."""
        self._supervisor.abandon(why)

    def run(self) -> None:
        """Run ticks until the supervisor has quit."""
        deadline, n_ticks, lingered = time.monotonic_ns() + TICK_NS, 0, 0
        while lingered < LINGER:
            left = deadline - time.monotonic_ns()
            for chunk in self._links.wait(max(left, 0) * 1e-9):
                slot = self._slots[chunk.link]
                self._supervisor.receive(slot, chunk.data, chunk.t_ns * 1e-9)
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
            # Missed ticks are not made up for after a pause.
            deadline = now + TICK_NS if late > TICK_NS else deadline + TICK_NS
            if n_ticks % REPORT_EVERY == 0:
                self._say([self._supervisor.report()])
                self._ask()
            lingered += self._supervisor.quit

    def close(self) -> None:
        """Send neutral to all cars; close ports and socket."""
        for name, slot in self._slots.items():
            self._send(name, "neutral", self._drivers[slot].neutral)
        self._links.close()
        self._talk.close()

    def _act(self, now: int, late: float) -> None:
        """Send every car its command."""
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
        # Each port is written separately: a failed one does not affect the others.
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
        """Send a message of a driver; report a failure once, without effect on other cars."""
        try:
            data = words()
            if data:
                self._links.send(name, data)
        except Exception as error:  # of any kind: the other cars must get their messages
            if (name, what) not in self._failed:
                self._failed.add((name, what))
                self._say([Notice(f"{name}: its driver cannot make the {what}: {error}")])

    def _listen(self) -> bool:
        """Process pending messages; return whether one of them requires acting at once."""
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
                # A closed socket stays readable.
                self._links.unwatch(self._talk.fileno())
                if not self._supervisor.quit:
                    self.abandon("the deciding process is gone")
                return True
            try:
                message = unpack(data, self._n_cars)
            except ValueError as error:
                self._say([Notice(f"supervisor: it received an unreadable message, {error}")])
                continue
            decided |= isinstance(message, Decision | Order)
            self._say(self._supervisor.take(message))

    def _say(self, messages: Sequence[Message]) -> None:
        """Send messages to the deciding process; drop those that it does not take."""
        for message in messages:
            with contextlib.suppress(OSError):
                self._talk.send(pack(message))


def _now_us() -> int:
    return time.monotonic_ns() // 1000


def asleep_ns() -> int:
    """Return the time for which the computer was suspended since its start [ns]; 0 if unknown.

    The monotonic clock does not count this time.
    """
    if not hasattr(time, "CLOCK_BOOTTIME"):
        return 0
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME) - time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def _hurry() -> None:
    """Raise the process priority; keep the default without permission."""
    with contextlib.suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, 0, -10)
    # The supervisor uses a twentieth of a core at most, and other processes can wait for it.
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(10))
