"""Comparison of controllers and policies on the same seeds, by scenario and observation mode."""
