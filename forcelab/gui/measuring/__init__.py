"""How long the window keeps a coder waiting: ``forcelab measure view``.

One file for each thing that is measured, always in the real window. It lives here and not in
:mod:`forcelab.measure`, which keeps the numbers (:mod:`forcelab.measure.latency`), because only the
gui may know Qt, and what is measured must not know who measures it.
"""
