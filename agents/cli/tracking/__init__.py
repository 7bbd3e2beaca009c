"""Commands that track recordings and evaluate filters."""
