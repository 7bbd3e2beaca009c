"""Detection of faults, and what is done about them."""
