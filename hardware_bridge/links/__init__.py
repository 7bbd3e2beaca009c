"""Ports: serial and TCP, opened, read, lost and found again."""
