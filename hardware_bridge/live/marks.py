"""The newest signed messages, kept from start to start: older ones stay refused.

Without, a recording of an earlier boot would be believed until the first true message comes.
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
"""[ns] From one write to the next."""
AHEAD = 4000
"""[-] So many messages of each device count as seen, more than come until the next write: nothing
that was heard before a crash is believed after it."""
OURS = "commands"
"""Who signs them: we."""
Marks: TypeAlias = Mapping[str, Mapping[int, Mark]]
"""Boot and number of the newest message, by who shares a key and by id."""


def read_marks(path: Path) -> Marks:
    """What was kept; nothing if there is no file.

    Raises:
        BridgeError: It cannot be read, or is damaged.
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
    """What JSON holds of them.

    Raises:
        ValueError: It does not; or TypeError or AttributeError.
    """
    marks = {}
    for who, devices in raw.items():
        marks[who] = {int(device): (boot, number) for device, (boot, number) in devices.items()}
        if any(type(value) is not int for mark in marks[who].values() for value in mark):
            raise ValueError("expected whole numbers")
    return marks


class KeptMarks:
    """The marks of an intake in a file."""

    def __init__(self, path: Path, intake: Intake, wall_s: int = 0) -> None:
        """Refuse what is older than what the file knows.

        Args:
            path: Of the file; made if it is not there.
            intake: Whose devices they are.
            wall_s: Time by the calendar, as far as the host knows it [s].

        Raises:
            BridgeError: It cannot be read or written, or is damaged.
        """
        self._path, self._intake = path, intake
        self.known = read_marks(path)
        """As they were."""
        intake.restore(self.known)
        newest, _ = self.known.get(OURS, {}).get(0, (0, 0))
        self.boot = max(wall_s, newest + 1)
        """Of what we sign ourselves in this start: higher than that of any start before, even where
        the host's calendar has gone back."""
        self._due: int | None = None
        self._writing: threading.Thread | None = None
        try:
            self._write(self._with_ours())
        except OSError as error:
            raise BridgeError(f"{path}: cannot be written ({error.strerror})") from error

    def keep(self, t_ns: int) -> None:
        """Write them now and then; a slow disk delays no command.

        Args:
            t_ns: Now, by the host's clock [ns].
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
        """Write what they are, without more ahead."""
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
