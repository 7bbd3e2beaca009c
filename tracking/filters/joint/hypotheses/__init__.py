"""Rotation and reflection of a group: the bank of hypotheses, what spawns them, alignment."""
