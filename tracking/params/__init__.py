"""Parameters: read from tables, checked, and chosen by name."""
