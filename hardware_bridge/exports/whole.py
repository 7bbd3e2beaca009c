"""Targets of exports: created completely or not at all, and never overwritten."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hardware_bridge.errors import BridgeError


@contextmanager
def whole_file(path: Path | str) -> Iterator[Path]:
    """Yield a path next to the target for a file that is moved there on success.

    Raises:
        BridgeError: The target exists, or cannot be written.
    """
    path = Path(path)
    with _errors(path):
        _check_free(path)
        scratch = _beside(path)
        try:
            yield scratch
            _check_free(path)
            scratch.rename(path)
        finally:
            scratch.unlink(missing_ok=True)


@contextmanager
def whole_folder(path: Path | str) -> Iterator[Path]:
    """Yield an empty folder next to the target that is moved there on success.

    Raises:
        BridgeError: The target exists and is not an empty folder, or cannot be written.
    """
    path = Path(path)
    with _errors(path):
        _check_free(path, empty_is_free=True)
        scratch = _beside(path)
        scratch.mkdir()
        try:
            yield scratch
            _check_free(path, empty_is_free=True)
            if path.exists():
                path.rmdir()
            scratch.rename(path)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)


@contextmanager
def _errors(path: Path) -> Iterator[None]:
    """Convert errors of the system to errors that name the target."""
    try:
        yield
    except OSError as error:
        raise BridgeError(f"{path}: cannot be written ({error.strerror or error})") from error


def _check_free(path: Path, *, empty_is_free: bool = False) -> None:
    taken = path.exists() or path.is_symlink()
    if taken and empty_is_free and path.is_dir() and not path.is_symlink():
        taken = any(path.iterdir())
    if taken:
        raise BridgeError(f"{path}: exists already, expected a new name")


def _beside(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path.parent / f".{path.name}-{secrets.token_hex(6)}"
