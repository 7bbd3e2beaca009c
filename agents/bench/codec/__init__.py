"""Benchmark of our wire format in frames per second, against pymavlink in the same run.

Both decode and encode the same number of frames of their own format, after a check that every
frame is decoded. They alternate, and the best turn of each counts.
"""

from agents.bench.codec.rows import bench_codec

__all__ = ["bench_codec"]
