"""Measurements: error against run time, and the simulated beside the real."""
