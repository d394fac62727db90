"""The search over the constants of the model that the paper leaves open.

``calibrate.calibrate(folder, pool, watch, force=False)``
    is behind ``teamsight calibrate``. `folder` must exist, and `watch` is called with a phase, the work done in it and
    its work in all.

The winner is copied to ``agents/settings.py`` by hand, because a default is a decision.
"""
