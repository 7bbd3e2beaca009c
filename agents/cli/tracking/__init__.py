"""Commands for tracking of recordings and evaluation of filters."""
