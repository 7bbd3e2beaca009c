"""Who has a device open, as far as one may see."""

from __future__ import annotations

import os
from pathlib import Path


def port_users(path: str, processes: Path = Path("/proc")) -> list[str]:
    """Other programs that have `path` open, ``name (process id)``.

    Those of other users are seen by root only; systems without /proc tell nothing.
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
            continue  # ended meanwhile, or another user's
    return sorted(users)
