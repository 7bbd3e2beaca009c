"""Interface of policies in simulation and on hardware: views, observations, actions, infos."""
