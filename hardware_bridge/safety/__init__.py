"""Safety gate: pure rules that limit the cars' commands, and the process that applies them."""
