"""Where compiled code is kept: one folder per state of the kernel sources, so an edited law never runs as its old self.

Numba's own cache notices only a change of the file that holds the function, not of the files it calls.
"""

import hashlib
import os
import platform
import sys
import tempfile
from importlib import import_module
from importlib.metadata import version
from pathlib import Path


def kernel_key() -> str:
    """Hash of every *kernels.py of the package, the numba version and the kind of CPU."""
    digest = hashlib.sha256()
    here = Path(__file__).parent
    for source in sorted(here.rglob("*kernels.py")):
        digest.update(str(source.relative_to(here)).encode() + b"\0" + source.read_bytes())
    digest.update(f"{version('numba')} {sys.version_info[:2]} {platform.machine()} {_cpu()}".encode())
    return digest.hexdigest()[:16]


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


def cache_folder() -> Path:
    """The user's cache folder for this state of the kernels, or a temporary one where that cannot be written."""
    base = os.environ.get("PATCHFEM_CACHE") or os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    for root in (Path(base), Path(tempfile.gettempdir())):
        folder = root / "patchfem" / kernel_key()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            probe = folder / f".probe{os.getpid()}"
            probe.touch()
            probe.unlink()
            return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="patchfem"))


def load(module: str, say=None):
    """A module of compiled code of the package, such as "dynamics.modal_kernels", its code cached on disk; `say` is
    told when nothing is there yet and it has to compile first."""
    if f"patchfem.{module}" not in sys.modules:
        folder = cache_folder()
        os.environ["NUMBA_CACHE_DIR"] = str(folder)
        if say is not None and not any(folder.rglob("*.nbi")):
            say("compiling the time loop for this machine, once (10 to 30 s)")
        import numba

        numba.config.CACHE_DIR = str(folder)
    return import_module(f"patchfem.{module}")
