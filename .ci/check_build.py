"""Compare what the repository, the sdist and the wheel hold of the package: each must have all files of the others."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

FOLDERS = ("agents", "world", "policies", "analysis")


def packaged(path: str) -> str | None:
    """Return the place of a file of the repository in the package, or None if it is not part of it."""
    first, _, rest = path.partition("/")
    if first == "teamsight":
        return None if rest in FOLDERS else path
    return f"teamsight/{path}" if first in FOLDERS else None


def in_package(paths: list[str]) -> set[str]:
    return {place for path in paths if (place := packaged(path))}


def main(folder: Path) -> int:
    sdists, wheels = list(folder.glob("*.tar.gz")), list(folder.glob("*.whl"))
    if len(sdists) != 1 or len(wheels) != 1:
        print(f"{folder}: must hold one sdist and one wheel, has {sorted(path.name for path in folder.iterdir())}")
        return 1
    tracked = subprocess.run(["git", "ls-files"], capture_output=True, text=True, check=True).stdout.splitlines()
    with tarfile.open(sdists[0]) as archive:
        inside = [member.name.partition("/")[2] for member in archive.getmembers() if not member.isdir()]
    with zipfile.ZipFile(wheels[0]) as archive:
        built = {name for name in archive.namelist() if ".dist-info/" not in name}
    kernels = {name for name in built if name.endswith(".kernel")}
    places = {"repository": in_package(tracked) | kernels, "sdist": in_package(inside), "wheel": built}
    everything = set().union(*places.values())
    missing = [(file, name) for name, files in places.items() for file in sorted(everything - files)]
    for file, name in missing:
        print(f"{file}: missing in the {name}")
    strange = sorted(file for file in built if not file.startswith("teamsight/"))
    for file in strange:
        print(f"{file}: in the wheel outside the package")
    if not {"teamsight/py.typed", "teamsight/agents/world.py", "teamsight/world/arena.py"} <= built:
        print("the wheel lacks py.typed or a folder")
        return 1
    if missing or strange:
        return 1
    print(f"{len(everything)} files of the package, the same in the repository, the sdist and the wheel")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
