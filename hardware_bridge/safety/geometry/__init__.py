"""Distances and turning circles for the rules of the gate."""
