"""Writing a small file so that it is whole or as it was, even where power fails."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def write_safely(path: Path, text: str, mode: int = 0o644) -> None:
    """Replace a file by a text.

    Args:
        path: The file; made if it is not there.
        text: All that it shall hold.
        mode: Permissions of the file.

    Raises:
        OSError: It cannot be written; then it is as it was.
    """
    # A name of its own: of two who write at once, each writes a whole file.
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".new", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
            os.fchmod(stream.fileno(), mode)
            stream.write(text)
            stream.flush()
            # Without this the name may be on the disk before the text.
            os.fsync(stream.fileno())
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
