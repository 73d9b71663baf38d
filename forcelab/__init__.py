"""forcelab: label and recognise force actions."""

__version__ = "0.1.0"
