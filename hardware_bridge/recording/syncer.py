"""Periodic sync of a growing file to the disk, while another thread writes.

A sync can take arbitrarily long. The writing thread continues meanwhile, so that records are soon
passed to the operating system and survive the end of the process.
"""

from __future__ import annotations

import errno
import os
import threading

SYNC_S = 1.0
"""[s] Interval of syncs; plus the duration of one, the largest loss by a power cut."""
_CANNOT = (errno.EINVAL, errno.ENOTSUP, errno.EROFS)
"""Errors of files that do not support sync."""


class Syncer:
    """Periodic sync of a file until it is stopped.

    Args:
        fd: The file; it must stay open until `stop` has returned.
    """

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._end = threading.Event()
        self.failure: str | None = None
        """Reason of a failed sync, after which the disk may lack written data."""
        self._thread = threading.Thread(target=self._run, name="recording sync", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Sync once more and end the thread, however long that takes."""
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        ending = False
        while not ending:
            ending = self._end.wait(SYNC_S)
            try:
                os.fsync(self._fd)
            except OSError as error:
                if error.errno not in _CANNOT:
                    self.failure = str(error.strerror or error)
