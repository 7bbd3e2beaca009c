"""`relpos bench train`: training speed next to an environment that costs nothing."""

from __future__ import annotations

from agents.bench.train.rows import bench_train

__all__ = ["bench_train"]
