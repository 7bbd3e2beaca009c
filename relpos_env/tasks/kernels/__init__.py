"""Kernels of the tasks."""
