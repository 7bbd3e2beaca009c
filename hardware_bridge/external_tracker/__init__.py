"""Positions from an external tracker in place of our own."""
