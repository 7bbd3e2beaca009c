"""Checks of measurements before any filter takes them."""
