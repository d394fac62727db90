"""PLACEHOLDER"""

if __name__ != "teamsight.agents":
    raise ImportError("import teamsight.agents: the folder agents/ is a part of the package teamsight, not a package of its own")
