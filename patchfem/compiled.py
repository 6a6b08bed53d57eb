"""Where compiled code is kept: one folder per state of the kernel sources, so an edited law never runs as its old self.

Numba's own cache notices only a change of the file that holds the function, not of the files it calls. A function that
is handed another one as an argument is never cached at all, so a loop that should run with any law is a text of its own
per law: `instance` writes it beside the compiled code, with the import of the law exchanged.
"""

import hashlib
import os
import platform
import re
import sys
import tempfile
from functools import cache
from importlib import import_module
from importlib.metadata import version
from importlib.util import module_from_spec, spec_from_file_location
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
        _prepared(say)
    return import_module(f"patchfem.{module}")


def instance(module: str, parts: dict, say=None):
    """A module of compiled code with others in place of modules that it imports.

    module: as of `load`; parts: name under which the module imports another (`from . import other as name`) -> the
    module, or its name as of `load`, that takes its place and must offer the same functions. The text differs from the
    file in these lines alone, so its lines have the numbers of the file in every traceback. It is kept in the folder of
    the compiled code, under a name with the hash of its content, and written in one move: processes may ask for it at
    once, and the package may be read-only. ValueError where the module has no such part.
    """
    home = Path(__file__).parent.joinpath(*module.split("."))
    text = home.with_suffix(".py").read_text("utf-8")
    for part, other in parts.items():
        name = other.__name__ if hasattr(other, "__name__") else f"patchfem.{other}"
        text, count = re.subn(rf"(?m)^from \.[\w.]* import \w+ as {part}$", f"import {name} as {part}", text)
        if count != 1:
            raise ValueError(f"patchfem.{module} imports its part {part} {count} times, not once")
    return written(f"{module}_{digest(text)}", text, say)


def digest(text: str) -> str:
    """Short hash of a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def written(module: str, text: str, say=None):
    """The module of compiled code, named as of `load`, whose text is kept in the folder of the compiled code."""
    name = f"patchfem.{module}"
    if name not in sys.modules:
        path = _prepared(say) / "instances" / f"{module}.py"
        if not path.exists():
            path.parent.mkdir(exist_ok=True)
            draft = path.with_suffix(f".{os.getpid()}")
            draft.write_text(text, "utf-8")
            draft.replace(path)
        spec = spec_from_file_location(name, path)
        sys.modules[name] = module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


@cache
def _prepared(say=None) -> Path:
    """The folder of the compiled code, made known to numba."""
    folder = cache_folder()
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if say is not None and not any(folder.rglob("*.nbi")):
        say("compiling the time loop for this machine, once (10 to 30 s)")
    import numba

    numba.config.CACHE_DIR = str(folder)
    return folder
