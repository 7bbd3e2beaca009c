"""The supervisor as a process of its own, which owns the ports of the cars.

A thread of the deciding process would hang with it, and be late under load. The two talk through
a pair of sockets; when that of the deciding process closes, it is gone, and the cars stop.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import select
import signal
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.context import SpawnProcess

from hardware_bridge.config.swarm import CarConfig
from hardware_bridge.drivers import make_driver
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
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
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.supervisor import Supervisor

TICK_NS = 10_000_000
REPORT_EVERY = 5
"""[ticks]"""
LINGER = 30
"""[ticks] Neutral is sent so many times before the ports are closed."""
START = 60.0
"""[s] For the start of the process, which loads compiled code."""
ROOM = 1 << 20
"""[bytes] Of the sockets' buffers."""


@dataclass(frozen=True, slots=True)
class Charge:
    """What a supervisor is started with."""

    params: SafetyParams
    n_cars: int
    cars: tuple[tuple[int, CarConfig], ...]
    """Slot and configuration; none in a dry run."""


class SupervisorProcess:
    """The deciding process's end."""

    def __init__(self, charge: Charge) -> None:
        """Start it and wait until it has its ports.

        Raises:
            BridgeError: A port of a car cannot be opened.
        """
        self._n_cars = charge.n_cars
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for end in (ours, theirs):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, ROOM)
        ours.setblocking(False)
        self._socket = ours
        spawn = multiprocessing.get_context("spawn")
        self.process: SpawnProcess = spawn.Process(
            target=supervise, args=(charge, theirs), name="relpos supervisor", daemon=True
        )
        self.process.start()
        theirs.close()
        problem = self._wait_ready()
        if problem:
            self.close()
            raise BridgeError(problem)

    def _wait_ready(self) -> str:
        """Why it cannot begin; empty if it does."""
        readable, *_ = select.select([self._socket], [], [], START)
        try:
            answer = unpack(self._socket.recv(ROOM), self._n_cars) if readable else None
        except (OSError, ValueError):
            answer = None
        return answer.problem if isinstance(answer, Ready) else "supervisor: it did not start"

    def fileno(self) -> int:
        """Readable when it has something to say."""
        return self._socket.fileno()

    def send(self, message: Message) -> bool:
        """Tell it; False if it is gone, or so far behind that it will stop the cars anyway."""
        try:
            self._socket.send(pack(message))
        except (BlockingIOError, OSError):
            return False
        return True

    def receive(self) -> list[Message]:
        """All that it said since the last call."""
        messages: list[Message] = []
        with contextlib.suppress(BlockingIOError, OSError):
            while data := self._socket.recv(ROOM):
                messages.append(unpack(data, self._n_cars))
        return messages

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self.process.is_alive()

    def close(self) -> None:
        """Let the cars stand and end it; by closing the socket, if it does not listen."""
        self._socket.close()
        self.process.join(timeout=2.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()


def supervise(charge: Charge, talk: socket.socket) -> None:
    """What the process does until it is told to quit or left alone.

    Args:
        charge: What it is responsible for.
        talk: Its end of the pair.
    """
    # Ctrl-C in a terminal reaches both; the deciding process says what is to be done.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _hurry()
    talk.setblocking(False)
    try:
        watch = _Watch(charge, talk)
    except BridgeError as error:
        talk.send(pack(Ready(str(error))))
        talk.close()
        return
    try:
        talk.send(pack(Ready()))
        watch.run()
    finally:
        watch.close()


class _Watch:
    """The supervisor with its ports, in its process."""

    def __init__(self, charge: Charge, talk: socket.socket) -> None:
        self._talk, self._n_cars = talk, charge.n_cars
        boot = time.time_ns() // 1_000_000_000  # rises from start to start, as a MAC asks for
        self._drivers = {
            slot: make_driver(car.driver, car.node, car.options, car.key, boot, _now_us)
            for slot, car in charge.cars
        }
        self._slots = {car.port.name: slot for slot, car in charge.cars}
        self._supervisor = Supervisor(charge.params, charge.n_cars, self._drivers)
        specs = [car.port for _, car in charge.cars]
        self._links = Links(specs, time.monotonic_ns)
        for driver in self._drivers.values():
            driver.drive(0.0, 0.0)  # loads what is compiled; nothing is sent

        self._links.watch(talk.fileno())
        self._up: set[str] = set()

    def run(self) -> None:
        """Tick after tick."""
        deadline, n_ticks, lingered = time.monotonic_ns() + TICK_NS, 0, 0
        while lingered < LINGER:
            left = deadline - time.monotonic_ns()
            for chunk in self._links.wait(max(left, 0) * 1e-9):
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
        """Release ports and socket."""
        self._links.close()
        self._talk.close()

    def _act(self, now: int, late: float) -> None:
        """Tell every car what it may do now."""
        up = {name for name in self._slots if self._links.is_up(name)}
        for name in up - self._up:
            self._links.send(name, self._drivers[self._slots[name]].opening())
        self._up = up
        sent = self._supervisor.tick(now * 1e-9, late, [self._slots[name] for name in up])
        for name, slot in self._slots.items():
            # Each by itself: one that fails keeps none of the others from being told.
            self._links.send(name, sent[slot])
        self._supervisor.written(time.monotonic_ns() * 1e-9)
        said: list[Message] = [
            Notice(f"{n.link} {'up' if n.up else f'down: {n.reason}'}")
            for n in self._links.drain_notices()
        ]
        self._say([*said, *self._supervisor.stopped()])

    def _ask(self) -> None:
        for name, slot in self._slots.items():
            question = self._drivers[slot].ask()
            if question:
                self._links.send(name, question)

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
                if not self._supervisor.quit:
                    self._links.unwatch(self._talk.fileno())
                    self._supervisor.abandon()
                return True
            message = unpack(data, self._n_cars)
            decided |= isinstance(message, Decision | Order)
            self._say(self._supervisor.take(message))

    def _say(self, messages: Sequence[Message]) -> None:
        """Tell the deciding process; if it does not listen, so be it."""
        for message in messages:
            with contextlib.suppress(OSError):
                self._talk.send(pack(message))


def _now_us() -> int:
    return time.monotonic_ns() // 1000


def _hurry() -> None:
    """Ask for a place before other processes; without the right to, the default has to do."""
    with contextlib.suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, 0, -10)
