"""Fault detection and fault handling."""
