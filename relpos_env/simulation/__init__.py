"""Simulation of one room with scripted drivers and a recording."""
