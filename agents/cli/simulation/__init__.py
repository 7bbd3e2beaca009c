"""Commands that simulate and train."""
