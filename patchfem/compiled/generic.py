"""Machine code that came with the package, for a common kind of CPU: the first run of a machine compiles nothing.

A wheel that `hook` made with PATCHFEM_MACHINE_CODE=1 holds code of the usual kernels for x86-64-v3, or for any aarch64,
in `generic/KEY/`, with the files of a folder of compiled code. KEY is a hash of the kernels, of how they are called, of
numba, llvmlite and the kind of machine: with other ones nothing is found, and what runs is compiled here. So it is on a
CPU that lacks what the code asks for, and where numba checks every index.

Code that was made for this very machine is taken first; where there is none, the code of the wheel stays in use, and
nothing replaces it: rigs behind bonds, tanh and LuGre and the shipped one took no longer with it than with native code
(0.6 to 1.0 of its CPU seconds, on a busy machine).
"""

import os
import platform
import sys
from functools import cache
from pathlib import Path

from ..disk.installed import version

HERE = Path(__file__).parent
V3 = "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"  # LLVM's names of what x86-64-v3 adds to v2
# kind of machine -> LLVM's name of the common CPU, and what it asks for
CPUS = {"x86_64": ("x86-64-v3", V3), "aarch64": ("generic", ()), "arm64": ("generic", ())}


def key(sources) -> str:
    """The name of the folder of code for this kind of machine; sources: makes the hash of the kernels."""
    digest = sources()
    digest.update((HERE / "machine.py").read_bytes())
    digest.update(f"{version('numba')} {version('llvmlite')} {sys.platform} {platform.machine()}".encode())
    return digest.hexdigest()[:16]


@cache
def folder(sources) -> Path | None:
    """The folder of code that came with these kernels and that this CPU can run, else None; sources: as of `key`."""
    if not (HERE / "generic").is_dir() or os.environ.get("NUMBA_BOUNDSCHECK"):
        return None
    found = HERE / "generic" / key(sources)
    return found if found.is_dir() and runs_here() else None


def runs_here() -> bool:
    """Whether this CPU has what the common CPU of its kind has."""
    from llvmlite import binding

    try:
        features = binding.get_host_cpu_features()
    except RuntimeError:  # LLVM does not know
        return False
    return platform.machine() in CPUS and all(features.get(one) for one in CPUS[platform.machine()][1])
