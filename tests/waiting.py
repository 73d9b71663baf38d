"""How long tests wait."""

#: Seconds that anything may take here that comes at once on a machine with nothing else to do.
PATIENCE = 240.0
