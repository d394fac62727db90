"""Many worlds: run them, read the results, decide δ, check claims, draw."""

if __name__ != "teamsight.analysis":
    raise ImportError(
        "import teamsight.analysis: the folder analysis/ is a part of the package teamsight, not a package of its own"
    )
