"""PLACEHOLDER"""

if __name__ != "teamsight.policies":
    raise ImportError("import teamsight.policies: the folder policies/ is a part of the package teamsight, not a package of its own")
