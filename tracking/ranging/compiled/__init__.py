"""Compiled ranging session for batches of environments."""
