"""Processes that have a device open, as far as visible."""

from __future__ import annotations

import os
from pathlib import Path


def port_users(path: str, processes: Path = Path("/proc")) -> list[str]:
    """Return other programs that have `path` open, as ``name (process id)``.

    Programs of other users are visible to root only; systems without /proc give an empty list.
    """
    device = os.path.realpath(path)
    users = []
    for process in processes.glob("[0-9]*"):
        if process.name == str(os.getpid()):
            continue
        try:
            held = any(os.readlink(fd) == device for fd in (process / "fd").iterdir())
            if held:
                users.append(f"{(process / 'comm').read_text().strip()} ({process.name})")
        except OSError:
            continue  # process ended, or belongs to another user
    return sorted(users)
