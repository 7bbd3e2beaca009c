"""Benchmark of environment steps, against mpe2 and bare pymunk in the same run.

Environments have three cars with sensors at 100 Hz, a message-level radio and the joint tracker. An
env-step is one control step of 0.1 s, or ten physics steps, of all cars of one environment. Every
figure includes resets after episodes of 600 steps, but not the computation of actions. Environment
and peer alternate, and the best turn of each counts.
"""

from agents.bench.env.rows import bench_env

__all__ = ["bench_env"]
