"""Training with RLlib on the same environment, for clusters; needs `relpos-env[rllib]`."""
