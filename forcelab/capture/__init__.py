"""Devices and cameras, their clocks, the journal, and how a recording becomes a demonstration."""
