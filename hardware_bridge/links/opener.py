"""Opening of ports in threads, so that a slow one does not delay others.

Name resolution, a host that does not answer, or an adapter that is just being plugged in may each
take seconds to succeed or fail.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable
from typing import TypeAlias

from hardware_bridge.links.ports import PortSpec
from hardware_bridge.links.stream import Port
from hardware_bridge.systems import expect_posix

OpenPort: TypeAlias = Callable[[PortSpec], Port]


def open_port(spec: PortSpec) -> Port:
    """Open a port of any kind.

    Raises:
        BridgeError: The port cannot be opened; the message names a remedy.
    """
    if spec.port.startswith("tcp:"):
        from hardware_bridge.links.tcp_port import TcpPort

        return TcpPort(spec)
    if spec.port.startswith("file:"):
        from hardware_bridge.links.file_port import FilePort

        return FilePort(spec)
    from hardware_bridge.links.serial_port import SerialPort

    return SerialPort(spec)


class Opener:
    """Opens each requested port in a separate thread."""

    def __init__(self, open_port: OpenPort = open_port) -> None:
        self._open_port = open_port
        self._lock = threading.Lock()
        self._closed = False
        self._done: list[tuple[str, Port | Exception]] = []
        expect_posix("listening to ports")
        self._wake, self._waker = os.pipe()
        os.set_blocking(self._wake, False)
        os.set_blocking(self._waker, False)

    def fileno(self) -> int:
        """Return a descriptor that is readable when results are available."""
        return self._wake

    def ask(self, spec: PortSpec) -> None:
        """Start to open a port; not to be called again for it before its result."""
        threading.Thread(target=self._open, args=(spec,), name=spec.name, daemon=True).start()

    def done(self) -> list[tuple[str, Port | Exception]]:
        """Return the results since the last call: names, and open ports or errors."""
        with self._lock, contextlib.suppress(BlockingIOError):
            while len(os.read(self._wake, 4096)) == 4096:
                pass
        with self._lock:
            done, self._done = self._done, []
        return done

    def close(self) -> None:
        """Close without waiting; ports that open later are closed at once."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            for _, port in self._done:
                if not isinstance(port, Exception):
                    port.close()
            self._done.clear()
            os.close(self._wake)
            os.close(self._waker)

    def _open(self, spec: PortSpec) -> None:
        result: Port | Exception
        try:
            result = self._open_port(spec)
        except Exception as error:
            result = error
        with self._lock:
            if not self._closed:
                self._done.append((spec.name, result))
                with contextlib.suppress(BlockingIOError):
                    os.write(self._waker, b".")
            elif not isinstance(result, Exception):
                result.close()
