"""A device at a pseudo terminal that can be unplugged and plugged in again."""

import os
import time
from pathlib import Path


class FakeDevice:
    """Master end of a pty behind a permanent path, like /dev/serial/by-id/..."""

    def __init__(self, path: Path):
        self.path = path
        self.master = -1
        self.plug()

    def plug(self):
        self.master, slave = os.openpty()
        os.set_blocking(self.master, False)
        new = self.path.with_suffix(".new")
        new.symlink_to(os.ttyname(slave))
        new.replace(self.path)
        os.close(slave)

    def unplug(self):
        if self.master >= 0:
            os.close(self.master)
            self.master = -1

    def say(self, data: bytes) -> int:
        """Send as much as fits; return the number of bytes."""
        try:
            return os.write(self.master, data)
        except BlockingIOError:
            return 0

    def heard(self) -> bytes:
        try:
            return os.read(self.master, 1 << 16)
        except (BlockingIOError, OSError):
            return b""


def until(links, done, seconds=10.0):
    """Wait with the links until `done` returns true; return all chunks since then."""
    end = time.monotonic() + seconds
    chunks = []
    while not done(chunks):
        assert time.monotonic() < end, "it did not happen"
        chunks += links.wait(0.05)
    return chunks
