"""One environment form for each library."""
