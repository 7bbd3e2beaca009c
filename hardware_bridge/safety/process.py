"""The supervisor process, which owns the ports of the cars.

A thread would hang with the deciding process, and be late under load. The two processes are
connected by a socket pair; when the deciding process's end closes, the cars stop.
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
"""[s] Timeout for the start of the process, which loads compiled code."""


class SupervisorProcess:
    """The deciding process's end of the connection."""

    def __init__(self, charge: Charge) -> None:
        """Start the supervisor and wait until its ports are open.

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
        """True once `receive` has detected that the supervisor ended or was killed."""
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
        """Return the reason for a failed start; empty if the supervisor runs."""
        readable, *_ = select.select([self._socket], [], [], START)
        try:
            answer = unpack(self._socket.recv(ROOM), self._n_cars) if readable else None
        except (OSError, ValueError):
            answer = None
        return answer.problem if isinstance(answer, Ready) else "supervisor: it did not start"

    def fileno(self) -> int:
        """Return a file descriptor that is readable when messages are pending."""
        return self._socket.fileno()

    def send(self, message: Message) -> bool:
        """Send a message; return False if the supervisor is gone, or so late that the cars stop."""
        try:
            self._socket.send(pack(message))
        except (BlockingIOError, OSError):
            return False
        return True

    def receive(self) -> list[Message]:
        """Return all messages since the last call."""
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
        """True while the process runs."""
        return self.process.is_alive()

    def close(self) -> None:
        """Stop the cars and end the supervisor by closing the socket; kill it after a timeout.

        A second call has no effect.
        """
        if self._socket.fileno() < 0:
            return
        self._socket.close()
        self.process.join(timeout=2.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()
