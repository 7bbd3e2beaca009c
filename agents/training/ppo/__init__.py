"""Proximal policy optimisation: networks, rollout buffer, learner."""
