"""Shapes, curves, paths, and the assignment of places."""
