"""Devices: what is plugged in."""
