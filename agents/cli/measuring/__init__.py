"""Commands that measure and compile."""
