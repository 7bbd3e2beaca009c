"""Batched environment: world, tracker, task and outcome of a step."""
