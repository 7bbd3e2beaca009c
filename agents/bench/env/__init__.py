"""How fast the environments step, next to mpe2 and bare pymunk in the same run.

Three cars with sensors at 100 Hz, a radio of messages and the joint tracker; an env-step is one
decision of 0.1 s, ten steps of the physics, of every car of one environment. Episodes have 600
steps and the next one begins at once: what that costs is in every figure. The actions of all
cars are made outside of the time. Ours and the peer take turns, and of each the best turn counts.
"""

from agents.bench.env.rows import bench_env

__all__ = ["bench_env"]
