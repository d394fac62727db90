"""Minds without a world: what a policy is told, what it may answer, and the policies of the field."""

if __name__ != "teamsight.policies":
    raise ImportError("import teamsight.policies: the folder policies/ is a part of the package teamsight, not a package of its own")
