"""Results on disk: whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from agents.errors import UsageError


def write_results(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Write named texts and pictures into a folder, all of them or none.

    All are written next to their places first and only then moved, so that a full disk leaves
    nothing and a kill no half file. Files of the same names are replaced.

    Raises:
        UsageError: The folder cannot be written to.
    """
    check_folder(folder, files)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=".writing-", dir=folder))
    except OSError as error:
        raise UsageError(f"--out {folder}: cannot be written to ({error.strerror})") from error
    try:
        for name, text in files.items():
            path = scratch / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text.encode() if isinstance(text, str) else text)
        for name in files:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (scratch / name).replace(folder / name)
    except OSError as error:
        raise UsageError(f"--out {folder}: cannot be written to ({error.strerror})") from error
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return folder


def check_folder(folder: Path, names: Iterable[str]) -> None:
    """See that files of these names can be written, before any work is done for them.

    Raises:
        UsageError: They cannot.
    """
    try:
        for name in names:
            _check_free(folder, name)
    except OSError as error:
        raise UsageError(f"--out {folder}: cannot be written to ({error.strerror})") from error


def check_new(folder: Path, hint: str = "") -> None:
    """See that a folder is new or empty, for results that must not mix with others.

    Args:
        folder: That is to be written to.
        hint: What else would do.

    Raises:
        UsageError: It exists and is no empty folder.
    """
    try:
        taken = folder.exists() and (not folder.is_dir() or any(folder.iterdir()))
    except OSError as error:
        raise UsageError(f"--out {folder}: cannot be written to ({error.strerror})") from error
    if taken:
        raise UsageError(f"--out {folder}: exists already, expected a new or empty folder{hint}")


def _check_free(folder: Path, name: str) -> None:
    """See that a file can take its place: no folder there, no file where a folder must be."""
    target = folder / name
    if target.is_dir():
        raise UsageError(f"--out {folder}: {name} is a folder there, expected a file or nothing")
    for parent in target.parents:
        if parent.exists():
            if not parent.is_dir():
                raise UsageError(f"--out {folder}: {parent} is a file, expected a folder")
            # What may be done there is known for sure once it is done.
            tempfile.TemporaryDirectory(prefix=".writing-", dir=parent).cleanup()
            return
