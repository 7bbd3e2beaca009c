"""Benchmark of policy inference, against the same network in plain numpy in the same run.

Policies and peer get the same observations and must return the same actions, which is checked
before the timing. They alternate, and the best turn of each counts.
"""

from agents.bench.policy.rows import bench_policy

__all__ = ["bench_policy"]
