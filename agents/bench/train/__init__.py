"""Benchmark of training speed, against training in an environment without cost."""

from __future__ import annotations

from agents.bench.train.rows import bench_train

__all__ = ["bench_train"]
