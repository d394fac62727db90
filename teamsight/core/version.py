"""The version of the package. It is here, because `teamsight` itself names modules that write it into files."""

__version__ = "0.1.0"
