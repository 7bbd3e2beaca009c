"""Training with RLlib on clusters, with the same environment; needs `relpos-env[rllib]`."""
