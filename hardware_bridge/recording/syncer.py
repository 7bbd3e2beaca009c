"""Forcing a growing file onto the disk from time to time, while another thread writes.

A sync can take as long as the disk likes. The writing thread goes on meanwhile, so that what is
recorded is soon in the hands of the system, where the end of the process cannot reach it.
"""

from __future__ import annotations

import errno
import os
import threading

SYNC_S = 1.0
"""[s] Between two syncs: with the time one takes, what a power cut may cost."""
_CANNOT = (errno.EINVAL, errno.ENOTSUP, errno.EROFS)
"""What files answer that cannot be synced at all."""


class Syncer:
    """Syncs a file until it is stopped.

    Args:
        fd: The file; it stays open until `stop` came back.
    """

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._end = threading.Event()
        self.failure: str | None = None
        """Why a sync failed, so that the disk may lack what was written."""
        self._thread = threading.Thread(target=self._run, name="recording sync", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Sync once more and come to an end, however long that takes."""
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
