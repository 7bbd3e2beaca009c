"""Distances, imminent contacts and lines of sight between cars and boxes."""
