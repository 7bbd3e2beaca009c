"""Replay protection across restarts: marks of the newest signed messages, kept in a file.

Without it, a recording of an earlier boot would be accepted until the first genuine message.
"""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

from hardware_bridge.errors import BridgeError
from hardware_bridge.identity.verdict import Mark
from hardware_bridge.ingest.intake import Intake
from hardware_bridge.safe_file import write_safely

EVERY_NS = 10_000_000_000
"""[ns] Period of writes."""
AHEAD = 4000
"""[-] Number of further messages of each device that count as received, more than come until the
next write: no message from before a crash is accepted after it."""
OURS = "commands"
"""Name for our own commands in `Marks`."""
Marks: TypeAlias = Mapping[str, Mapping[int, Mark]]
"""Boot and number of the newest message, by owners of a key and by id."""


def read_marks(path: Path) -> Marks:
    """Return the marks in a file; none if it does not exist.

    Raises:
        BridgeError: The file cannot be read, or is damaged.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return {}
    except (OSError, UnicodeDecodeError) as error:
        raise BridgeError(f"{path}: cannot be read ({error})") from error
    try:
        return parse_marks(json.loads(text))
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise BridgeError(
            f"{path}: damaged, so which signed messages are old is not known; delete it if none "
            "can have been recorded"
        ) from error


def parse_marks(raw: Mapping[str, Mapping[str, list[int]]]) -> Marks:
    """Return the marks in parsed JSON.

    Raises:
        ValueError: The marks are invalid; or TypeError or AttributeError.
    """
    marks = {}
    for who, devices in raw.items():
        marks[who] = {int(device): (boot, number) for device, (boot, number) in devices.items()}
        if any(type(value) is not int for mark in marks[who].values() for value in mark):
            raise ValueError("expected whole numbers")
    return marks


class KeptMarks:
    """The marks of an intake, kept in a file."""

    def __init__(self, path: Path, intake: Intake, wall_s: int = 0) -> None:
        """Restore the marks of a file and write the boot number of this start.

        Args:
            path: Path of the file; created if missing.
            intake: Intake of the devices.
            wall_s: Wall-clock time of the host [s].

        Raises:
            BridgeError: The file cannot be read or written, or is damaged.
        """
        self._path, self._intake = path, intake
        self.known = read_marks(path)
        """Marks at the start."""
        intake.restore(self.known)
        newest, _ = self.known.get(OURS, {}).get(0, (0, 0))
        self.boot = max(wall_s, newest + 1)
        """Boot number of our own signed commands: higher than that of any earlier start, even if
        the host's wall clock was set back."""
        self._due: int | None = None
        self._writing: threading.Thread | None = None
        try:
            self._write(self._with_ours())
        except OSError as error:
            raise BridgeError(f"{path}: cannot be written ({error.strerror})") from error

    def keep(self, t_ns: int) -> None:
        """Write the marks periodically, in a thread, so that a slow disk delays no command.

        Args:
            t_ns: Current host time [ns].
        """
        if self._due is None:
            self._due = t_ns
        if t_ns < self._due or (self._writing is not None and self._writing.is_alive()):
            return
        self._due = t_ns + EVERY_NS
        args = (self._with_ours(AHEAD),)
        self._writing = threading.Thread(target=self._try_to_write, args=args, daemon=True)
        self._writing.start()

    def close(self) -> None:
        """Write the current marks, without messages ahead."""
        if self._writing is not None:
            self._writing.join()
        self._try_to_write(self._with_ours())

    def _with_ours(self, ahead: int = 0) -> Marks:
        return {**self._intake.marks(ahead), OURS: {0: (self.boot, 0)}}

    def _try_to_write(self, marks: Marks) -> None:
        with contextlib.suppress(OSError):
            self._write(marks)

    def _write(self, marks: Marks) -> None:
        write_safely(self._path, json.dumps(marks) + "\n")
