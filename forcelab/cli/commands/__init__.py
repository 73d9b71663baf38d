"""The commands, a module each: its docstring is the manual, `add_options` and `run` the rest."""
