"""Nodes and cars that are not there, behind real serial devices."""
