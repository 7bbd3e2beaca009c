"""Writing a small file so that it is whole or as it was, even where power fails."""

from __future__ import annotations

import os
from contextlib import suppress
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
    scratch = path.with_name(f".{path.name}.new")
    with suppress(FileNotFoundError):
        scratch.unlink()
    descriptor = os.open(scratch, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
        stream.write(text)
        stream.flush()
        # Without this the name may be on the disk before the text.
        os.fsync(stream.fileno())
    scratch.replace(path)
