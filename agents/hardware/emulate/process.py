"""The emulator in its own process; a drive uses only its ports."""

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
"""[s] Longest start-up of emulator and drive."""


class EmulationProcess:
    """Context with the process of an emulator; has its figures after the exit."""

    start_ns = 0
    """[ns] Host time of the start of the world."""
    collisions = 0
    """[-] Collisions."""
    late_steps = 0
    """[-] Steps more than 10 ms late."""

    def __init__(self, options: EmulateOptions, place: Path) -> None:
        """Create the process without starting it.

        Args:
            options: Options of the emulation, which runs `LONGEST_START` longer.
            place: Folder of the ports, and of the log ``truth`` written at the end.
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
            # An error of the drive itself takes precedence.
            why = said if isinstance(said, Exception) else "its process was ended from outside"
            raise UsageError(f"emulator: it failed: {why}")


def _emulate(options: EmulateOptions, place: Path, pipe: Connection) -> None:
    """Emulate in the process until it is interrupted."""
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
