"""Training of policies with Stable-Baselines3: the only part that needs torch."""
