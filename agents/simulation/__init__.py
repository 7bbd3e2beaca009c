"""Recording, demonstration and display of simulated drives."""
