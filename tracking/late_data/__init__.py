"""Ordering of late and out-of-order measurements."""
