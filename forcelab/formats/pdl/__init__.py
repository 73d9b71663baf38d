"""The paper's databases: several pickles one after another, read without executing any."""

from forcelab.formats.pdl.reader import read, sniff

__all__ = ["read", "sniff"]
