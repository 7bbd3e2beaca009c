"""Late and out-of-order measurements become an ordered stream."""
