"""Walls, obstacles and the free floor of a room."""
