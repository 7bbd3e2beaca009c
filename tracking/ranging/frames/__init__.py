"""Bytes, time stamps and durations of ranging messages."""
