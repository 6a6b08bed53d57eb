"""Machine code that comes with a wheel, for a common kind of CPU, so that a first run compiles nothing.

A wheel made with PATCHFEM_MACHINE_CODE=1 (`hook`) has the code of the usual kernels for x86-64-v3 or for any aarch64
in `generic/KEY/`. KEY is a hash of the kernels, of how they are called, of numba, llvmlite and the kind of machine; if
it differs, if this CPU lacks an instruction, or if numba checks every index, the code is compiled here instead.

Code that was compiled on this machine is taken first. Otherwise the code of the wheel stays in use: rigs took 0.6 to
1.0 times the CPU seconds that they take with code compiled for the machine itself.
"""

import os
import platform
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ..disk.installed import find_package_version

HERE = Path(__file__).parent


class CommonCpu(NamedTuple):
    """A common CPU: LLVM's name, and the instruction sets that its code needs."""

    name: str
    needs: tuple


CPUS = {  # by kind of machine
    "x86_64": CommonCpu(
        "x86-64-v3", ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
    ),
    "aarch64": CommonCpu("generic", ()),
    "arm64": CommonCpu("generic", ()),
}


def key(sources) -> str:
    """Return the name of the folder of code for this kind of machine; sources: returns the hash of the kernels."""
    digest = sources()
    digest.update((HERE / "machine.py").read_bytes())
    digest.update(
        f"{find_package_version('numba')} {find_package_version('llvmlite')} {sys.platform} {platform.machine()}".encode()
    )
    return digest.hexdigest()[:16]


@cache
def folder(sources) -> Path | None:
    """Return the folder of code that came with these kernels, None if there is none that this CPU can run."""
    if not (HERE / "generic").is_dir() or os.environ.get("NUMBA_BOUNDSCHECK"):
        return None
    found = HERE / "generic" / key(sources)
    return found if found.is_dir() and runs_here() else None


def runs_here() -> bool:
    """Check whether this CPU has the instructions of the common CPU of its kind."""
    from llvmlite import binding

    try:
        features = binding.get_host_cpu_features()
    except RuntimeError:  # LLVM does not know this CPU
        return False
    return platform.machine() in CPUS and all(
        features.get(name) for name in CPUS[platform.machine()].needs
    )
