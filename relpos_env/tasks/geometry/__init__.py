"""Shapes, curves, shortest paths, and the assignment of slots."""
