"""Rotation and reflection of a group: bank of hypotheses, initialisation, alignment."""
