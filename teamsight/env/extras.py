"""The packages that environments need beside those of teamsight."""

from __future__ import annotations

import importlib.util


def require(*packages: str, cure: str = "pip install 'teamsight[env]'") -> None:
    """Refuse to go on without optional packages.

    Parameters
    ----------
    *packages : str
        Names to import.
    cure : str
        The command that installs them.

    Raises
    ------
    ImportError
        If one is not installed; the message has the command that installs it.
    """
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    if missing:
        raise ImportError(
            f"teamsight.env needs {' and '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed: "
            f"{cure}"
        )
