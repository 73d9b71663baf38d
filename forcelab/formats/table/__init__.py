"""Text tables as found in the wild, and the labels files beside them."""

from forcelab.formats.table.reader import read, sniff

__all__ = ["read", "sniff"]
