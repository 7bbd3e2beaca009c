"""The emulator in its own process; the drive sees only its ports."""

from __future__ import annotations

import multiprocessing
import os
import signal
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from agents.errors import UsageError
from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.run import emulate
from agents.jobs.child import end_with_parent

LONGEST_START = 120.0
"""[s] From the first byte to cars that drive."""


class EmulationProcess:
    """The emulator's process, from its first byte on until it is left; then with its figures."""

    start_ns = 0
    """[ns] Host time of the world's beginning."""
    collisions = 0
    """[-] That cars began."""
    late_steps = 0
    """[-] By more than 10 ms."""

    def __init__(self, options: EmulateOptions, place: Path) -> None:
        """Set it up.

        Args:
            options: The emulation; it lasts for `LONGEST_START` longer than they say.
            place: Folder of the ports, and of ``truth`` in the end.
        """
        spawn = multiprocessing.get_context("spawn")
        self._pipe, theirs = spawn.Pipe()
        self._process = spawn.Process(target=_emulate, args=(options, place, theirs))

    def __enter__(self) -> EmulationProcess:
        self._process.start()
        said = self._pipe.recv() if self._pipe.poll(LONGEST_START) else None
        if said != "ready":
            self._process.kill()
            raise said if isinstance(said, Exception) else TimeoutError("emulator: did not start")
        return self

    def __exit__(self, *error: object) -> None:
        if self._process.pid is not None and self._process.is_alive():
            os.kill(self._process.pid, signal.SIGINT)
        said = None
        with suppress(EOFError):  # it was killed
            said = self._pipe.recv() if self._pipe.poll(LONGEST_START) else None
        self._process.join(timeout=LONGEST_START)
        self._process.close()
        if isinstance(said, tuple):
            self.start_ns, self.collisions, self.late_steps = said
        elif error[0] is None:
            # What went wrong with the drive itself is the more telling.
            why = said if isinstance(said, Exception) else "its process was ended from outside"
            raise UsageError(f"emulator: it failed: {why}")


def _emulate(options: EmulateOptions, place: Path, pipe: Connection) -> None:
    """What that process does, until it is interrupted."""
    end_with_parent()
    try:
        result = emulate(
            folder=place,
            options=options,
            wait=LONGEST_START,
            seconds=options.seconds + LONGEST_START,
            log=place / "truth",
            ready=lambda rig: pipe.send("ready"),
        )
    except Exception as error:
        pipe.send(error)
        return
    pipe.send((result.start_ns, result.collisions, result.lateness.late))
