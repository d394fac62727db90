"""Physics without minds: arenas, placement, bodies, motion, who is near whom, noise, and the clock."""

if __name__ != "teamsight.world":
    raise ImportError(
        "import teamsight.world: the folder world/ is a part of the package teamsight, not a package of its own"
    )
