"""Simulated drives: recorded, demonstrated and shown."""
