"""How long one step of a policy takes, next to the same network in plain numpy in the same run.

Both policies and their peer see the same observations and give the same actions, which is checked
before anything is timed. They take turns, and of each the best turn counts.
"""

from agents.bench.policy.rows import bench_policy

__all__ = ["bench_policy"]
