"""The contract a policy sees: views, observations, actions. The same in simulation and on cars."""
