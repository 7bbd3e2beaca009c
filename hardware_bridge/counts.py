"""What came of bytes: how many frames, and how much that was none."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Counts:
    """What a decoder met since it was made."""

    n_bytes: int = 0
    frames: int = 0
    """Frames that were whole and right."""
    skipped: int = 0
    """Frames or lines that were whole and say nothing to us: prompts, other messages."""
    damaged: int = 0
    """Frames or lines that were refused: check sum, length, a number that cannot be."""
    strange: int = 0
    """Bytes between frames that belong to none."""
