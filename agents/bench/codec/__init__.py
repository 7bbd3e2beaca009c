"""Frames per second of our wire format, next to pymavlink in the same run.

Ours and the peer decode and encode as many frames of their own formats; that each frame comes out
is checked before anything is timed. They take turns, and of each the best turn counts.
"""

from agents.bench.codec.rows import bench_codec

__all__ = ["bench_codec"]
