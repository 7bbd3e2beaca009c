"""Commands for simulation and training."""
