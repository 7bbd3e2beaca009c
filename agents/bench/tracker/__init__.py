"""How long the tracker takes, next to filterpy and GTSAM on the same measurements.

A step is what one moment brings: a new orientation and acceleration of every node, and some
ranges of that time. In a `round` every pair ranges; in a `message` one node with half the group,
as in large groups, where every message brings so many. Timed is a group that has long started,
with the fastest of a few runs.
"""

from agents.bench.tracker.rows import bench_tracker

__all__ = ["bench_tracker"]
