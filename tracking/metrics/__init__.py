"""Errors, consistency, integrity and bounds of estimates."""
