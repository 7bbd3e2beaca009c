"""The version: the newest git tag, or that of the changelog where there is no tag."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent
TAG = re.compile(r"v(\d+)\.(\d+)\.(\d+)-(\d+)-g")
HEADING = re.compile(r"^## \[(\d+\.\d+\.\d+)\]", re.MULTILINE)


def version() -> str:
    """Return ``1.2.3`` at the tag v1.2.3 and ``1.2.4.dev5`` five commits later."""
    command = ["git", "describe", "--tags", "--long", "--match", "v[0-9]*"]
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        # A source distribution, or a clone without tags.
        return HEADING.findall((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))[0]
    found = TAG.match(done.stdout)
    if found is None:
        raise ValueError(f"git tag: expected v1.2.3, got {done.stdout.strip()!r}")
    major, minor, patch, distance = map(int, found.groups())
    if distance == 0:
        return f"{major}.{minor}.{patch}"
    return f"{major}.{minor}.{patch + 1}.dev{distance}"
