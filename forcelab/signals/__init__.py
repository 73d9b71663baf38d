"""Signals: channels, wavelets and their transforms."""
