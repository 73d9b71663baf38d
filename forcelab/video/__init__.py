"""Video: which codecs work on this machine, and frames by their own timestamps."""
