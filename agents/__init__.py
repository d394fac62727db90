"""Where mind meets world: robots and targets, what they perceive, and the model that steps them."""

if __name__ != "teamsight.agents":
    raise ImportError(
        "import teamsight.agents: the folder agents/ is a part of the package teamsight, not a package of its own"
    )
