"""One room that is driven by a script and recorded."""
