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

from teamsight.cli.warm import use_all
from teamsight.core.kernel import cache, entry, report


def main() -> None:
    """Compile them anew."""
    config.CPU_NAME, config.CPU_FEATURES = cache.GENERIC[platform.machine()][0], ""
    shutil.rmtree(cache.SHIPPED, ignore_errors=True)
    with tempfile.TemporaryDirectory() as folder, report.listening(lambda number: None):
        os.environ[cache.VARIABLE] = folder
        use_all(lambda done, total: None)
        cache.SHIPPED.mkdir()
        sizes = []
        for one in entry.READY:
            code = cache.KernelCache(one.function).kept.load(cache.read)
            # Numba's functions differ between its versions.
            if code is not None and not code.needs_numba:
                cache.shipped_place(one.function).save(code)
                sizes.append(len(code.binary))
    kilobytes = sum(sizes) / 1e3
    print(f"{len(sizes)} kernels of {kilobytes:.0f} kB, by numba {numba.__version__}, in {cache.SHIPPED}")


if __name__ == "__main__":
    main()
