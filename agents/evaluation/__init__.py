"""Errors, consistency and cost of the filters over many simulated runs."""
