"""Results on disk: whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from agents.errors import UsageError


def write_results(folder: Path, files: Mapping[str, str]) -> Path:
    """Write named text files into a folder, all of them or none.

    All are written beside their places first and only then moved, so that a full disk leaves
    nothing and a kill no half file. Files of the same names are replaced.

    Raises:
        UsageError: The folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=".writing-", dir=folder))
    except OSError as error:
        raise UsageError(f"--out {folder}: cannot be written to ({error.strerror})") from error
    try:
        for name, text in files.items():
            path = scratch / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        for name in files:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (scratch / name).replace(folder / name)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return folder
