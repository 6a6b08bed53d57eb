"""Machine code in the wheel for a common CPU, which spares the first run the compilation.

A wheel built with PATCHFEM_MACHINE_CODE=1 (`hook`) contains the code of the usual kernels for x86-64-v3 or for any
aarch64 in `generic/KEY/`. KEY is a hash of the kernels, of the calling convention (`machine`), of the versions of numba
and llvmlite and of the kind of machine. If KEY differs, if this CPU lacks an instruction set, or if numba checks every
index, the kernels are compiled on this machine.

Code that was compiled on this machine has priority over that of the wheel. With the code of the wheel, rigs took 0.6 to
1.0 times the CPU seconds that they take with code compiled for the machine itself.
"""

import os
import platform
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ..disk.installed import find_package_version

COMPILED_FOLDER = Path(__file__).parent


class CommonCpu(NamedTuple):
    """Common CPU: its name in LLVM and the instruction sets that its code needs."""

    name: str
    instruction_sets: tuple[str, ...]


COMMON_CPUS = {  # common CPU for each value of `platform.machine()`
    "x86_64": CommonCpu(
        "x86-64-v3", ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
    ),
    "aarch64": CommonCpu("generic", ()),
    "arm64": CommonCpu("generic", ()),
}


def compute_key(hash_sources) -> str:
    """Return the name KEY of the folder of code for this kind of machine.

    `hash_sources` is a function that returns the hash object of the kernels.
    """
    digest = hash_sources()
    digest.update((COMPILED_FOLDER / "machine.py").read_bytes())
    digest.update(
        f"{find_package_version('numba')} {find_package_version('llvmlite')} {sys.platform} {platform.machine()}".encode()
    )
    return digest.hexdigest()[:16]


@cache
def find_folder(hash_sources) -> Path | None:
    """Return the folder of code in the wheel; None if this CPU cannot run any.

    `hash_sources` is a function that returns a hash of the kernel sources, by which the code is found.
    """
    if not (COMPILED_FOLDER / "generic").is_dir() or os.environ.get("NUMBA_BOUNDSCHECK"):
        return None
    folder = COMPILED_FOLDER / "generic" / compute_key(hash_sources)
    return folder if folder.is_dir() and is_cpu_sufficient() else None


def is_cpu_sufficient() -> bool:
    """Return whether this CPU has the instruction sets of the common CPU of its kind."""
    from llvmlite import binding

    try:
        features = binding.get_host_cpu_features()
    except RuntimeError:  # LLVM does not know this CPU
        return False
    return platform.machine() in COMMON_CPUS and all(
        features.get(name) for name in COMMON_CPUS[platform.machine()].instruction_sets
    )
