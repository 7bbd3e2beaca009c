"""Distances, contacts to come and lines of sight between boxes."""
