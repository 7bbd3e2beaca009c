"""Rerun view of a swarm, in the browser or in a file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any

from agents.errors import UsageError
from agents.hardware.live.snapshot import Snapshot
from agents.hardware.view.layout import TIME, layout
from agents.hardware.view.plots import log_errors, log_numbers, style_plots
from agents.hardware.view.scene import log_scene
from tracking.arrays import F64, Bool
from tracking.estimate import TeamEstimate

APPLICATION = "relpos"
MEMORY = "512MiB"
"""Limit of the data kept for browsers that connect later; the oldest data is dropped."""


class Viewer:
    """Open view, usable as a context."""

    def __init__(
        self, rr: ModuleType, stream: Any, url: str | None, file: Path | None = None
    ) -> None:
        self._rr, self._stream, self._file = rr, stream, file
        self._styled = False
        self.url = url
        """Address of the view for a browser; None for a file."""

    def show(self, snapshot: Snapshot, notices: list[tuple[float, str]] | None = None) -> None:
        """Draw a snapshot.

        Args:
            snapshot: Snapshot of the swarm.
            notices: Time [s] and text of the notices since the last snapshot.
        """
        rr, stream = self._rr, self._stream
        with self._writing():
            if not self._styled:
                style_plots(rr, stream, snapshot)
                self._styled = True
            for t, text in notices or ():
                stream.set_time(TIME, duration=t)
                stream.log("notices", rr.TextLog(text))
            stream.set_time(TIME, duration=snapshot.t)
            log_scene(rr, stream, snapshot)
            log_numbers(rr, stream, snapshot)

    def show_errors(self, estimate: TeamEstimate, errors: F64, known: Bool) -> None:
        """Draw the errors of a whole run.

        Args:
            estimate: Estimates, arrays (time, ...).
            errors: Position errors against the truth, (time, pair) [m].
            known: True where the truth is known, (time, pair).
        """
        log_errors(self._rr, self._stream, TIME, estimate, errors, known)

    def close(self) -> None:
        """Flush buffered data and close the view."""
        with self._writing():
            self._stream.flush()
            self._stream.disconnect()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Convert errors of Rerun inside the context, and remove the file.

        Raises:
            UsageError: The disk is full, or the file cannot be written.
        """
        try:
            yield
        except Exception as error:  # Rerun raises different types
            if self._file is not None:
                self._file.unlink(missing_ok=True)
            raise UsageError(f"--view: cannot be written: {error}") from error

    def __enter__(self) -> Viewer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
        if error is not None and not self._styled and self._file is not None:
            self._file.unlink(missing_ok=True)  # nothing was drawn


def open_viewer(name: str, file: Path | None = None, *, browse: bool = True) -> Viewer:
    """Open a view in the browser, or one that is written to a file.

    Args:
        name: Name of the swarm.
        file: New file with the suffix ``.rrd``; None serves the view on this machine.
        browse: Whether to open a browser.

    Raises:
        UsageError: Rerun is not installed, the file exists or cannot be written, or a network port
            of the view is in use.
    """
    try:
        import rerun as rr
    except ImportError as error:
        raise UsageError(
            "--view: needs Rerun, pip install -e '.[view]' in its source folder"
        ) from error
    if file is not None:
        if file.suffix != ".rrd":
            raise UsageError(f"--view {file}: expected a name that ends in .rrd")
        if file.exists():
            raise UsageError(f"--view {file}: exists already, expected a new name")
    stream = rr.RecordingStream(APPLICATION)
    stream.send_recording_name(name)
    try:
        if file is not None:
            stream.save(file, default_blueprint=layout())
            return Viewer(rr, stream, None, file)
        server = stream.serve_grpc(default_blueprint=layout(), server_memory_limit=MEMORY)
        rr.serve_web_viewer(open_browser=browse, connect_to=server)
    except Exception as error:
        what = "" if file is None else f" {file}"
        raise UsageError(f"--view{what}: Rerun cannot show it: {error}") from error
    return Viewer(rr, stream, f"http://localhost:9090/?url={_quoted(server)}")


def _quoted(url: str) -> str:
    from urllib.parse import quote

    return quote(url, safe="")
