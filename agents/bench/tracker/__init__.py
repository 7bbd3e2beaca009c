"""Benchmark of the tracker against filterpy and GTSAM on the same measurements.

A step consists of the orientation and acceleration of every node, and of ranges at one time. In a
`round`, every pair ranges; in a `message`, one node ranges to half the group, as one message does
in large groups. The group is initialised before the timing, and the fastest of a few runs counts.
"""

from agents.bench.tracker.rows import bench_tracker

__all__ = ["bench_tracker"]
