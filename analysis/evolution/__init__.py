"""Evolution of the evolved policy's constants, and their comparison with A-CMOMMT.

``evolve.train(evolution, generations, folder, pool, watch, force=False)``
    is behind ``teamsight evolve train``. `Evolution(population, spread, seed)` from ``cma`` has the defaults.
``evolve.evaluate(folder, pool, watch, constants=None, training=None, runs=30, force=False)``
    is behind ``teamsight evolve test``.

`folder` must exist, and `watch` is called with a phase, the work done in it and its work in all.
"""
