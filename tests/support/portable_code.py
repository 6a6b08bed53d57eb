"""Make the portable code of the package: compile the functions that the usual scenes call, by numba.

    python tests/support/portable_code.py          write patchfem/kernel_cache/portable.xz
    python tests/support/portable_code.py FILE     write another file

The file is made and committed at a release. Its text depends on the kernels and on the versions in its header alone; on
another CPU, functions of numba itself may be laid out in another way.
"""

import lzma
import os
import platform
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[2]
TEMPLATES = ROOT / "patchfem/scene/templates"
# Scenes that call every function that a shipped scene calls: the engine from event to event, the marches of points and of
# lists of bonds and their histories, and the loop over the cases of a sweep.
RUNS = (
    TEMPLATES / "joint.toml",
    TEMPLATES / "rig.toml",
    ROOT / "studies/rig/rig.toml",
    ROOT / "studies/rig/report.toml",
)
SWEEP = TEMPLATES / "rig.toml", {"drive.acceleration": "3 g..6 g:64"}


def pack_portable_codes(codes: dict[str, bytes], kernel_hash: str, versions: str) -> bytes:
    """Return the content of the file, before its compression.

    Parameters
    ----------
    codes : dict
        Portable code with its header (`machine`) for each name of a file of machine code.
    kernel_hash : str
        Hash of the kernels and of their compiler.
    versions : str
        Versions of what made the code, on which its text depends.
    """
    from patchfem.kernel_cache import machine

    sizes = {name: len(codes[name]) for name in sorted(codes)}
    header = {"kernels": kernel_hash, "versions": versions, "sizes": sizes}
    return machine.join_file(header, b"".join(codes[name] for name in sizes))


def make_portable_codes() -> tuple[str, dict[str, bytes]]:
    """Compile the functions in this process, and return the versions of what made them and their codes by file name."""
    with TemporaryDirectory() as cache:
        os.environ["PATCHFEM_CACHE"] = cache
        sys.path.insert(0, str(ROOT))
        import llvmlite
        import numba
        from llvmlite import binding

        import patchfem as pf
        from patchfem import kernel_cache
        from patchfem.kernel_cache import machine

        kernel_cache.list_portable_codes = dict  # numba compiles although there is a file
        for scene in RUNS:
            pf.run(scene)
        pf.sweep(*SWEEP)
        versions = (
            f"Python {sys.version_info[0]}.{sys.version_info[1]}, numba {numba.__version__}, "
            f"llvmlite {llvmlite.__version__}, {platform.system()} {platform.machine()} {binding.get_host_cpu_name()}"
        )
        return versions, machine.PORTABLE_CODES


def main(path: str = "") -> None:
    """Write the file."""
    versions, codes = make_portable_codes()
    from patchfem import kernel_cache
    from patchfem.kernel_cache import portable

    data = lzma.compress(
        pack_portable_codes(codes, kernel_cache.hash_kernels(), versions), preset=9
    )
    Path(path or portable.PORTABLE_PATH).write_bytes(data)
    print(f"{len(codes)} functions, {len(data)} bytes, made with {versions}")


if __name__ == "__main__":
    main(*sys.argv[1:])
