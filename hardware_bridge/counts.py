"""Decoder statistics: numbers of valid, skipped and damaged frames."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Counts:
    """Counts of a decoder since its creation."""

    n_bytes: int = 0
    frames: int = 0
    """Frames that were complete and valid."""
    skipped: int = 0
    """Frames or lines that were complete but carry no reading: prompts, other messages."""
    damaged: int = 0
    """Frames or lines that were refused: check sum, length, an impossible number."""
    strange: int = 0
    """Bytes outside of any frame."""
