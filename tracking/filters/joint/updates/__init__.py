"""Measurement updates of the joint filter."""
