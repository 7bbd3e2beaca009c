"""The ranging session in compiled form, for batches of environments."""
