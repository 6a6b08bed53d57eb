"""Portable code of the functions that the usual scenes call, so that their first run compiles without numba.

Ten of the twelve CPU seconds that a first run compiles are spent in numba. The file `portable.xz` of a release contains what
numba makes in this time: LLVM code that names no CPU (`machine`), as text. LLVM turns it into machine code in one to three
seconds, with the same bits as if numba had compiled the function here.

    python tests/support/portable_code.py     make the file (at a release)
    xz -dc patchfem/kernel_cache/portable.xz      read it

The file is used if the hash of all kernels and of their compiler is that in its header, and if its own hash is intact. If
this version of LLVM cannot read the code, or for kernels that were edited since the release, numba compiles as it does
without the file. A test makes the file again and compares it byte by byte.
"""

import lzma
from functools import cache
from pathlib import Path

from .machine import split_file

PORTABLE_PATH = Path(__file__).with_name("portable.xz")


@cache
def read_portable_codes(kernel_hash: str) -> dict[str, bytes]:
    """Return the portable codes of the package by the names of their files of machine code.

    There are none if the file is missing, damaged or made for kernels with another hash than `kernel_hash`.
    """
    try:
        header, data = split_file(lzma.decompress(PORTABLE_PATH.read_bytes()))
        if header["kernels"] != kernel_hash:
            return {}
        sizes = header["sizes"]
    except (OSError, EOFError, lzma.LZMAError, ValueError, KeyError):
        return {}
    codes = {}
    for name, size in sizes.items():
        codes[name] = data[:size]
        data = data[size:]
    return codes
