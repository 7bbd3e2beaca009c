"""The supervisor as a process of its own, which owns the ports of the cars.

A thread of the deciding process would hang with it, and be late under load. The two talk through
a pair of sockets; when that of the deciding process closes, it is gone, and the cars stop.
"""

from __future__ import annotations

import multiprocessing
import select
import socket
from multiprocessing.context import SpawnProcess

from hardware_bridge.errors import BridgeError
from hardware_bridge.safety.charge import ROOM, Charge
from hardware_bridge.safety.messages import Message, Ready, pack, unpack
from hardware_bridge.safety.watch import supervise
from hardware_bridge.systems import expect_linux

START = 60.0
"""[s] For the start of the process, which loads compiled code."""


class SupervisorProcess:
    """The deciding process's end."""

    def __init__(self, charge: Charge) -> None:
        """Start it and wait until it has its ports.

        Raises:
            BridgeError: A port of a car cannot be opened.
        """
        self._n_cars = charge.n_cars
        expect_linux("driving cars")
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for end in (ours, theirs):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, ROOM)
        ours.setblocking(False)
        self._socket = ours
        self.gone = False
        """True once it has ended or was killed, after `receive` has found that out."""
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
        try:
            while data := self._socket.recv(ROOM):
                messages.append(unpack(data, self._n_cars))
            self.gone = True
        except BlockingIOError:
            pass
        except OSError:
            self.gone = True
        return messages

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self.process.is_alive()

    def close(self) -> None:
        """Let the cars stand and end it; by closing the socket, if it does not listen.

        The second time nothing is left to do.
        """
        if self._socket.fileno() < 0:
            return
        self._socket.close()
        self.process.join(timeout=2.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()
