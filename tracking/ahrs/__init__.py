"""Orientation of each node from its IMU and magnetometer: VQF and its surroundings."""
