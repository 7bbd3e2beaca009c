"""Recorder for loops that must not block.

`add` puts a record into a bounded queue; a thread writes. A full or slow disk costs records, which
are counted and reported, but never blocks the caller.
"""

from __future__ import annotations

import json
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hardware_bridge.recording.file import RecordingFile
from hardware_bridge.recording.format import OVERHEAD, Header, Kind, Record, check_record

MOST_WAITING = 8 << 20
"""[bytes] Bound of the queue: over a minute of data of a dozen nodes."""
RETRY_S = 1.0
"""[s] Delay of the next attempt after a failed write."""


@dataclass(frozen=True, slots=True)
class _Loss:
    """Number of records missing in the file, and the time of the first."""

    n: int
    t_ns: int

    @classmethod
    def of(cls, before: _Loss | None, n: int, t_ns: int) -> _Loss:
        return cls(n, t_ns) if before is None else cls(before.n + n, before.t_ns)


class Recorder:
    """An open recording.

    Records acknowledged by `flush` survive the end of the process, SIGKILL included. After a failed
    write the file ends with its last complete record; records are dropped until a write succeeds
    again, and an EVENT ``recording_lost`` reports their number.

    Args:
        path: File to create.
        header: Metadata of the recording.
        most_waiting: Bound of the queue [bytes].
        clock: Monotonic clock [s], for the time between attempts.
        write: Function like `os.write`.

    Raises:
        BridgeError: The file exists or cannot be written.
    """

    def __init__(
        self,
        path: Path | str,
        header: Header,
        *,
        most_waiting: int = MOST_WAITING,
        clock: Callable[[], float] = time.monotonic,
        write: Callable[[int, bytes], int] = os.write,
    ) -> None:
        self._file = RecordingFile(Path(path), header, write)
        self._clock = clock
        self._most_waiting = most_waiting
        self._changed = threading.Condition()
        # The following fields, down to `_closing`, are guarded by the condition's lock.
        self._queue: deque[Record | _Loss] = deque()
        self._waiting = 0
        self._added = self._handled = self._dropped = 0
        self._loss: _Loss | None = None
        self._lost: str | None = None
        self._failing = False
        self._closing = False
        # Used by the writing thread only: losses not yet in the file, time of the next attempt.
        self._unwritten: _Loss | None = None
        self._retry_at = clock()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    @property
    def lost(self) -> str | None:
        """Last reason for records missing in the file; None if it is complete."""
        return self._lost

    @property
    def dropped(self) -> int:
        """Number of records that are not in the file and will not be."""
        return self._dropped

    @property
    def failing(self) -> bool:
        """True if the last write failed, so that records are being dropped."""
        return self._failing

    def add(self, kind: Kind, link: int, t_ns: int, payload: bytes = b"") -> None:
        """Queue a record; never blocks on the disk, never raises."""
        try:
            record = Record(kind, link, t_ns, bytes(payload))
            check_record(record)
            if kind == Kind.HEADER:
                raise ValueError("a header comes once, at the start")
        except (ValueError, TypeError) as error:
            with self._changed:
                self._added += 1
                self._drop(1, f"not a record: {error}")
                if isinstance(t_ns, int) and 0 <= t_ns < 1 << 63:
                    self._loss = _Loss.of(self._loss, 1, t_ns)
            return
        size = len(record.payload) + OVERHEAD
        with self._changed:
            self._added += 1
            if self._closing:
                self._drop(1, "the recording is closed")
            elif self._waiting + size > self._most_waiting:
                self._drop(1, "the disk is too slow")
                self._loss = _Loss.of(self._loss, 1, t_ns)
            else:
                if self._loss is not None:
                    self._queue.append(self._loss)
                    self._loss = None
                self._queue.append(record)
                self._waiting += size
                self._changed.notify_all()

    def add_event(self, t_ns: int, event: str, **fields: object) -> None:
        """Queue an EVENT; values of types unknown to JSON are written as text."""
        text = json.dumps({"event": event, **fields}, default=str)
        self.add(Kind.EVENT, 0, t_ns, text.encode())

    def flush(self, timeout: float = 5.0) -> bool:
        """Wait until all records added so far are passed to the operating system.

        Returns:
            True if every one of those records is in the file, False if some were dropped or the
            timeout expired.
        """
        with self._changed:
            goal = self._added
            done = self._changed.wait_for(lambda: self._handled >= goal, timeout)
            return done and self._dropped == 0

    def close(self, timeout: float = 5.0) -> bool:
        """Write queued records and close the file.

        Returns:
            True if every added record is in the file and on the disk. A disk that blocks for longer
            than `timeout` [s] keeps its thread, which ends with the process.
        """
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(timeout)
        return not self._thread.is_alive() and self._lost is None

    def _drop(self, n: int, reason: str) -> None:
        """Count lost records; the lock is held."""
        self._dropped += n
        self._handled += n
        self._lost = reason
        self._changed.notify_all()

    def _run(self) -> None:
        try:
            while self._take_turn():
                pass
        except Exception as error:
            # An error here must show as a lost recording, and stop nothing else.
            with self._changed:
                self._closing = True
                self._drop(self._added - self._handled, f"the recorder failed: {error!r}")
        finally:
            self._file.close()
            self._note_sync()

    def _take_turn(self) -> bool:
        """Write the queued records; return False at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closing)
            closing, loss = self._closing, self._loss
            # Swapped, not copied: `add` blocks on this lock.
            queue, self._queue = self._queue, deque()
            if closing:
                self._loss = None
        batch = list(queue)
        if closing and loss is not None:
            batch.append(loss)
        if self._unwritten is not None and (batch or closing):
            batch.insert(0, self._unwritten)
            self._unwritten = None
        if batch:
            self._handle(batch, closing)
        self._note_sync()
        return not closing

    def _handle(self, batch: list[Record | _Loss], closing: bool) -> None:
        """Write a batch, or as much of it as the disk accepts."""
        now = self._clock()
        n, error = 0, self._lost
        if not self._failing or now >= self._retry_at or closing:
            n, error = self._file.append([self._record(item) for item in batch])
            if error is not None:
                self._retry_at = now + RETRY_S
        for item in batch[n:]:
            self._unwritten = _Loss.of(
                self._unwritten, item.n if isinstance(item, _Loss) else 1, item.t_ns
            )
        n_written = sum(isinstance(item, Record) for item in batch[:n])
        n_dropped = sum(isinstance(item, Record) for item in batch[n:])
        size = sum(len(r.payload) + OVERHEAD for r in batch if isinstance(r, Record))
        with self._changed:
            self._failing = n < len(batch)
            self._waiting -= size
            self._handled += n_written
            if n_dropped:
                self._drop(n_dropped, error or "the disk takes nothing")
            self._changed.notify_all()

    def _record(self, item: Record | _Loss) -> Record:
        """Return the record to write; for a loss an EVENT in place of the missing records."""
        if isinstance(item, Record):
            return item
        event = {"event": "recording_lost", "records": item.n, "why": self._lost}
        return Record(Kind.EVENT, 0, item.t_ns, json.dumps(event).encode())

    def _note_sync(self) -> None:
        """Store the reason of a failed sync: written data may not be on the disk."""
        if self._file.sync_failure is not None:
            with self._changed:
                self._lost = self._file.sync_failure
