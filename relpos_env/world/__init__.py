"""Simulated world: rooms, cars, contacts and their steps."""
