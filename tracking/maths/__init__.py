"""Mathematics without state: arrays in, arrays out."""
