"""Searches over the constants that the paper leaves open.

``calibrate.calibrate(name, folder, pool, watch, force=False)``
    is behind ``teamsight calibrate model`` and ``teamsight calibrate lazy``; the names are the keys of
    ``calibrate.SEARCHES``. `folder` must exist, and `watch` is called with a phase, the work done in it and its work
    in all.

The winner is copied by hand, because a default is a decision: that of "model" to ``agents/presets.py``, that of "lazy"
to the defaults of `LazyQ` and `Exploration`, to the shipped exploration and to ``paper/lazy_teams.py``.
"""
