"""Atomic replacement of a small file: complete or unchanged, even after a power failure."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def write_safely(path: Path, text: str, mode: int = 0o644) -> None:
    """Replace the content of a file atomically.

    Args:
        path: The file; created if missing.
        text: New content of the file.
        mode: Permissions of the file.

    Raises:
        OSError: The file cannot be written and is unchanged.
    """
    # Unique name: two concurrent writers each write a complete file.
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".new", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
            os.fchmod(stream.fileno(), mode)
            stream.write(text)
            stream.flush()
            # Without fsync the new name may reach the disk before the text.
            os.fsync(stream.fileno())
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
