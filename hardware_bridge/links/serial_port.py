"""Serial port, opened with pyserial, non-blocking.

Modem lines: Linux raises DTR and RTS together when a port is opened, and both stay raised, since
clearing one of them, or one after the other, resets some boards (on an ESP32, RTS without DTR pulls
the reset line). HUPCL is cleared, so that closing leaves both lines raised as well and a board with
a capacitor from DTR to reset (Arduino) restarts only when it is plugged in. Exceptions are devices
with `PortSpec.dtr` off, on which DTR stops a motor.
VMIN is 1: a read without data then returns EAGAIN, and an empty read means a hang-up.
"""

from __future__ import annotations

import contextlib
import errno
import time
from typing import TYPE_CHECKING, Any

from hardware_bridge.errors import BridgeError
from hardware_bridge.links.failures import number_of, reason_of
from hardware_bridge.links.port_list import (
    Listing,
    device_path,
    list_serial_ports,
    permission_remedy,
)
from hardware_bridge.links.port_users import port_users
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.links.stream import Stream

if TYPE_CHECKING:
    import serial

OLDEST_QUEUED = 0.02
"""[s] Longest time for bytes to wait in the queue; later commands are outdated."""
LEAST_QUEUED = 64
"""[bytes] Least queue size, so that a command always fits."""


class SerialPort:
    """An open serial port, 8N1, for exclusive use by this process. Implements `Port`."""

    def __init__(self, spec: PortSpec, listing: Listing = list_serial_ports) -> None:
        """Open the port.

        Args:
            spec: A path, or ``serial:NUMBER``.
            listing: Function that lists the available ports.

        Raises:
            BridgeError: The port does not exist, is not permitted, is in use, is no serial port or
                does not support the rate; the message names a remedy.
        """
        self.path = device_path(spec, listing)
        self._serial: Any = _opened(spec, self.path)
        try:
            _set_line(self._serial)
            if not spec.dtr:
                # Pseudo terminals and some adapters lack this line.
                with contextlib.suppress(OSError):
                    self._serial.dtr = False
            queued = max(LEAST_QUEUED, round(OLDEST_QUEUED * spec.baud / 10))
            self._stream = Stream(self._serial.fileno(), queued)
        except Exception as error:
            self._serial.close()
            raise BridgeError(f"{spec.name}: {self.path}: {reason_of(error)}") from error

    def fileno(self) -> int:
        """Return the descriptor to wait for bytes with."""
        return self._stream.fd

    def read(self) -> bytes:
        """Return all pending bytes."""
        return self._stream.read()

    def write(self, data: bytes) -> bool:
        """Accept all of `data`, or none of it; return whether it was accepted."""
        return self._stream.write(data)

    def flush(self) -> bool:
        """Continue to send a partly sent message."""
        return self._stream.flush()

    def close(self, linger: float = 0.0) -> None:
        """Close the port; discard bytes that were not sent after `linger` seconds.

        The kernel would wait for them, up to 30 s if the device accepts no bytes.
        """
        import termios

        if not self._serial.is_open:
            return
        with contextlib.suppress(Exception):
            for _ in range(round(linger / 0.001)):
                if self._stream.flush() and not self._stream.queued():
                    break
                time.sleep(0.001)
        with contextlib.suppress(Exception):
            if self._stream.queued():
                termios.tcflush(self._stream.fd, termios.TCOFLUSH)
        with contextlib.suppress(Exception):
            self._serial.close()


def _opened(spec: PortSpec, path: str) -> serial.Serial:
    try:
        import serial
    except ImportError as error:
        raise BridgeError(
            f"{spec.name}: serial ports need pyserial: "
            "pip install -e '.[hardware]' in its source folder"
        ) from error
    if spec.baud < 50:
        # A rate of 0 hangs up the line.
        raise BridgeError(f"{spec.name}: baud: expected at least 50, got {spec.baud}")
    try:
        # Opened in the constructor, with DTR and RTS asserted by the system, to avoid an edge.
        return serial.Serial(path, spec.baud, timeout=0, write_timeout=0, exclusive=True)
    except Exception as error:
        raise BridgeError(f"{spec.name}: {_why_not(error, path, spec.baud)}") from error


def _set_line(port: serial.Serial) -> None:
    import termios

    fd = port.fileno()
    settings = termios.tcgetattr(fd)
    settings[2] &= ~termios.HUPCL
    settings[6][termios.VMIN], settings[6][termios.VTIME] = 1, 0
    termios.tcsetattr(fd, termios.TCSANOW, settings)
    # FTDI adapters otherwise delay bytes by 16 ms; many ports do not support this mode.
    with contextlib.suppress(ValueError, NotImplementedError):
        port.set_low_latency_mode(True)


def _why_not(error: Exception, path: str, baud: int) -> str:
    """Return the reason why a port does not open, and a remedy."""
    number = number_of(error)
    text = str(error)
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        return f"no port {path}: plug it in; `relpos doctor` lists the ports there are"
    if number in (errno.EACCES, errno.EPERM):
        return f"no permission to open {path}: {permission_remedy(path)}"
    if number in (errno.EBUSY, errno.EAGAIN):
        users = ", ".join(port_users(path)) or "another program"
        return f"{path} is in use by {users}: end it first"
    if "not configure" in text or number in (errno.ENOTTY, errno.EISDIR):
        return f"{path} is not a serial port; `relpos doctor` lists those there are"
    if "baud" in text:
        return f"{path} cannot do {baud} baud: set a rate that the adapter knows"
    return f"cannot open {path}: {reason_of(error)}"
