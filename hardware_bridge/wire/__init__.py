"""The wire format of our own nodes."""
