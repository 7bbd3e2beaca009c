"""The simulated truth: rooms, cars, contacts and their steps."""
