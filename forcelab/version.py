"""The version of forcelab."""

__version__ = "0.1.0"
