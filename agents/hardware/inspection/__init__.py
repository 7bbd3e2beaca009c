"""Inspect ports, links and cars before anything drives."""
