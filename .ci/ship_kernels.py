"""Compile the kernels that come with a wheel, for any processor of this machine's kind.

``python .ci/ship_kernels.py`` writes them beside the code of the present checkout; the next wheel takes them along.
Where they fit neither the machine nor the code, kernels are compiled as without them.
"""

from __future__ import annotations

import os
import platform
import shutil
import tempfile

import numba
from numba.core import config

from teamsight.cli.warm import worlds
from teamsight.core.kernel import cache, entry, report


def main() -> None:
    """Compile them anew."""
    config.CPU_NAME, config.CPU_FEATURES = cache.GENERIC[platform.machine()][0], ""
    shutil.rmtree(cache.SHIPPED, ignore_errors=True)
    made: list[entry.Entry] = []
    get_ready = entry.Entry._get_ready

    def noted(one: entry.Entry) -> None:
        get_ready(one)
        made.append(one)

    entry.Entry._get_ready = noted  # type: ignore[method-assign]
    with tempfile.TemporaryDirectory() as folder, report.listening(lambda number: None):
        os.environ[cache.VARIABLE] = folder
        for make in worlds():
            world = make()
            with world.record():
                world.run(2)
            world.step()
        cache.SHIPPED.mkdir()
        size = 0
        for one in made:
            code = cache.KernelCache(one.function).kept.load(cache.read)
            # Numba's functions differ between its versions.
            if code is not None and not code.needs_numba:
                place = cache.shipped_place(one.function)
                place.save(code)
                size += len(code.binary)
    print(f"{len(made)} kernels of {size / 1e3:.0f} kB, by numba {numba.__version__}, in {cache.SHIPPED}")


if __name__ == "__main__":
    main()
