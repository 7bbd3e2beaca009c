"""Writing of results to disk."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from agents.errors import UsageError


def write_results(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Write named texts and pictures into a folder, replacing files of the same names.

    All files are written to a temporary folder first and then moved, so that a full disk leaves
    none of them and a killed process no partial file.

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
    """Check that files of these names can be written, before any computation.

    Raises:
        UsageError: A file cannot be written.
    """
    try:
        for name in names:
            _check_free(folder, name)
    except OSError as error:
        raise UsageError(f"--out {folder}: cannot be written to ({error.strerror})") from error


def check_new(folder: Path, hint: str = "") -> None:
    """Check that a folder is new or empty, for results that must not mix with others.

    Args:
        folder: Target folder.
        hint: Alternative for the error message.

    Raises:
        UsageError: The folder exists and is not empty.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise UsageError(f"--out {folder}: is a file, expected a new or empty folder")
        taken = folder.exists() and any(folder.iterdir())
    except OSError as error:
        raise UsageError(f"--out {folder}: cannot be written to ({error.strerror})") from error
    if taken:
        raise UsageError(f"--out {folder}: exists already, expected a new or empty folder{hint}")


def _check_free(folder: Path, name: str) -> None:
    """Check that the path of a file is no folder, and that its parents are folders."""
    target = folder / name
    if target.is_dir():
        raise UsageError(f"--out {folder}: {name} is a folder there, expected a file or nothing")
    for parent in target.parents:
        if parent.exists():
            if not parent.is_dir():
                raise UsageError(f"--out {folder}: {parent} is a file, expected a folder")
            # Only writing shows for certain whether the folder is writable.
            tempfile.TemporaryDirectory(prefix=".writing-", dir=parent).cleanup()
            return
