"""Compiled kernels and the cache of their machine code, one folder per state of the sources.

`load_compiled_module` returns a kernel module by name as a `KernelModule`, and `instantiate` returns a variant of it in
which some imports are replaced. The module, and with it numba, is imported only if a function is called whose machine
code is not stored.
`jit` contains the decorator `njit` of all kernels, `machine` compiles, stores and loads machine code, `portable` has code
that needs no numba. Where `machine` cannot store a function, numba compiles it in every process. Read
`load_compiled_module`, `instantiate` and `KernelFunction` first.

The folder is named by a hash of all kernel sources, since the code of a function contains that of the functions which it
calls. A loop for any friction law is written out once per law by `instantiate`, with the import of the law replaced.

NUMBA_DISABLE_JIT=1 runs every kernel as Python for debuggers and coverage tools. NUMBA_BOUNDSCHECK=1 compiles all
kernels again with checks of every index.

The optimisation level is 3 with vector instructions. A module whose loops are too short for them sets IS_VECTORISED =
False: the event-driven engine is then compiled 2 CPU seconds faster and runs as fast. The loop over many points takes
twice as long without them.
"""

import gc
import hashlib
import os
import platform
import re
import shutil
import sys
from contextlib import contextmanager, suppress
from functools import cache, partial
from importlib import import_module
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from threading import RLock
from time import monotonic, process_time, sleep, time
from typing import NamedTuple

from .. import cost_model
from ..disk import user_cache
from ..disk.installed import find_package_version
from ..disk.lock import lock_file
from . import machine
from .portable import read_portable_codes

# Names that other folders use, by module.
PUBLIC = {
    "jit": ("njit",),
}

PACKAGE_FOLDER = Path(__file__).parents[1]  # folder of the package
# Modules of tuples that kernels take, of row numbers and of constants; they belong to the hash because the
# machine code depends on the order of the fields and on the numbers.
TUPLE_MODULES = (
    "contact/set_arrays.py",
    "event_driven/records.py",
    "motion_measures.py",
    "points/rows.py",
)
# Time [s] since the last start of a process with a folder of compiled code after which it is removed: 30 days. Every edit of
# a kernel, every release and every kind of CPU makes a folder of 1 to 5 MB; several may share a home folder.
MAX_UNUSED_SECONDS = 30 * 86400.0
# Whether machine code is stored: on POSIX systems, unless an environment variable makes numba run all kernels as Python.
STORES_CODE = os.name == "posix" and os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")
# Time to wait for another process that compiles [s]: ten times the longest compilation.
MAX_LOCK_WAIT_SECONDS = 300.0
# Functions called by this process whose machine code cannot be stored, so that every
# process imports numba for them.
UNCACHED_FUNCTIONS = set()
# Lock that lets one thread at a time load code, because loading a function twice at the
# same time crashes the process.
CODE_LOADING_LOCK = RLock()
REPORT = [None]  # callback of the last run, see `report_compilation_to`


def hash_kernels() -> str:
    """Return the hash of all kernels, of the tuples that they take and of their compiler."""
    compiler = ("integer_enums.py", "jit.py", "machine.py", "pass_by_reference.py")
    sources = [PACKAGE_FOLDER / "kernel_cache" / name for name in compiler]
    sources += sorted(PACKAGE_FOLDER.rglob("*kernels.py"))
    sources += sorted((PACKAGE_FOLDER / "event_driven" / "laws").glob("*.py"))
    sources += [PACKAGE_FOLDER / name for name in TUPLE_MODULES]
    digest = hashlib.sha256()
    for source in sources:
        name = source.relative_to(PACKAGE_FOLDER).as_posix()
        digest.update(name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()


def compute_kernel_key() -> str:
    """Return a hash of the kernels, the versions of numba and llvmlite, and the CPU."""
    checked = os.environ.get("NUMBA_BOUNDSCHECK", "")
    versions = f"{find_package_version('numba')} {find_package_version('llvmlite')} {sys.version_info[:2]} {checked}"
    text = f"{hash_kernels()} {versions} {platform.machine()} {_describe_cpu()}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _describe_cpu() -> str:
    """Return the model of the CPU and its instruction sets."""
    lines = []
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    # The flags are needed because a virtual machine may hide some instruction sets of a CPU model.
    names = ("model name", "flags", "Features")
    descriptions = [line for line in dict.fromkeys(lines) if line.startswith(names)]
    return " ".join(descriptions) or platform.processor()


class CacheFolder(NamedTuple):
    """Folder of compiled code, and the reason why it is not in the user's cache; "" if it is."""

    path: Path
    problem: str


def find_cache_folder() -> CacheFolder:
    """Return the folder of compiled code for this state of the kernels.

    It lies in the user's cache. If that belongs to another user or cannot be written, it is a folder of this process.
    """
    name = Path("patchfem") / compute_kernel_key()
    folder = user_cache.find_cache_base() / name
    problem = user_cache.prepare_folder(folder)
    if problem:
        folder = user_cache.make_process_folder() / name
        user_cache.prepare_folder(folder)  # creates the folder if possible
    return CacheFolder(folder, problem)


@cache
def use_cache_folder() -> CacheFolder:
    """Return the folder of compiled code of this process, which its child processes use too."""
    folder = find_cache_folder()
    if folder.problem:
        os.environ["PATCHFEM_CACHE"] = str(folder.path.parents[1])
    else:
        remove_old_folders(folder.path)
    return folder


class KernelModule:
    """Kernel module that is imported when it is needed.

    Its attributes are compiled functions (`KernelFunction`), whose names are read from the source. Any other attribute
    imports the module.

    Parameters
    ----------
    name : str
        Full name of the module.
    text : str
        Its source.
    importer : callable
        Function without arguments that imports the module and returns it.
    """

    def __init__(self, name: str, text: str, importer):
        self.__name__ = name
        self.load_module = importer
        # Whether loops may become vector instructions
        self.is_vectorised = "\nIS_VECTORISED = False" not in text
        for function in re.findall(r"(?m)^@njit\b[^@]*?^def (\w+)", text):
            setattr(self, function, KernelFunction(self, function))

    def __getattr__(self, name: str):
        """Return an attribute, by its name, of the module, which is imported."""
        if name.startswith("__"):
            raise AttributeError(f"{self.__name__} has no {name}")
        return getattr(self.load_module(), name)


# Time [s] in which this process compiled code or waited for another process that did.
COMPILE_SECONDS = [0.0]


@contextmanager
def measure_compile_time():
    """Add the time of the block to `COMPILE_SECONDS`, and its CPU time to `cost_model.COMPILE_CPU_SECONDS`."""
    begin = monotonic()
    begin_cpu = process_time()
    try:
        yield
    finally:
        COMPILE_SECONDS[0] += monotonic() - begin
        cost_model.COMPILE_CPU_SECONDS[0] += process_time() - begin_cpu


@contextmanager
def pause_garbage_collection():
    """Pause the garbage collection in the block; it takes a seventh of the compile time."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@contextmanager
def lock_exclusively(path: Path):
    """Let one process at a time run the block, by a lock on the file `path`.

    Other processes wait for at most `MAX_LOCK_WAIT_SECONDS` seconds, because the lock of a machine that has disappeared may
    remain on a network file system.
    """
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        file = os.open(path, os.O_CREAT | os.O_RDWR, 0o600)
    except OSError:  # the folder is not writable
        yield
        return
    try:
        # Ask again and again. A lock that waits by itself could not be given up.
        end = monotonic() + MAX_LOCK_WAIT_SECONDS
        while not lock_file(file) and monotonic() < end:
            # Short compared with a compilation
            sleep(0.05)
        yield
    finally:
        os.close(file)


class KernelFunction:
    """Function of a kernel module.

    A call runs its stored machine code. If there is none, numba compiles the function.

    Parameters
    ----------
    module : KernelModule
        Module of the function.
    name : str
        Name of the function in the module.
    """

    def __init__(self, module: KernelModule, name: str):
        self.module = module
        self.name = name
        # Loaded function for each tuple of type codes; False if numba runs the function itself.
        self.loaded_functions = {}

    def __call__(self, *arguments):
        if not STORES_CODE:
            return self.get_dispatcher()(*arguments)
        type_codes, words = zip(*map(machine.convert_argument, arguments))
        function = self.loaded_functions.get(type_codes)
        if function is None:
            with CODE_LOADING_LOCK:
                # Another thread may have loaded it in the meantime.
                function = self.loaded_functions.get(type_codes)
                if function is None:
                    function = self._load_machine_code(type_codes, arguments)
                    self.loaded_functions[type_codes] = function
        return function(b"".join(words)) if function else self.get_dispatcher()(*arguments)

    def _load_machine_code(self, type_codes: tuple[str, ...], arguments: tuple[object, ...]):
        """Return the code for arguments of these types from its file, or compile it into the file.

        Portable code of the package needs no numba. Returns False if the function cannot be compiled in this way.
        """
        prefix = f"{self.module.__name__.removeprefix('patchfem.')}.{self.name}"
        folder = use_cache_folder().path / "code"
        path = folder / f"{prefix}-{hash_text(','.join(type_codes))}.code"
        if function := machine.load_file(path):
            return function
        with (
            measure_compile_time(),
            pause_garbage_collection(),
            lock_exclusively(path.with_suffix(".lock")),
        ):
            # Another process may have compiled it in the meantime.
            function = machine.load_file(path)
            if function is None:
                portable_code = list_portable_codes().get(path.name, b"")
                function = machine.compile_for_this_cpu(path, portable_code)
            if function is None:
                if REPORT[0] is not None:
                    _report_compilation(REPORT[0])
                compiler = import_module(f"{__name__}.jit").compile_unoptimised  # imports numba
                function = machine.compile_function(
                    path,
                    self.get_dispatcher(),
                    arguments,
                    compiler,
                    is_vectorised=self.module.is_vectorised,
                )
        if function is None:
            UNCACHED_FUNCTIONS.add(prefix)
        return function or False

    def get_dispatcher(self):
        """Return the dispatcher of the function, or the function itself if numba is disabled."""
        return getattr(self.module.load_module(), self.name)


_KERNEL_MODULES = {}  # `KernelModule` by its name without that of the package


def report_compilation_to(report) -> None:
    """Set the function that receives a message, once per process, if numba compiles a function; None keeps the last one."""
    if report is not None:
        REPORT[0] = report


def load_compiled_module(module: str) -> KernelModule:
    """Return a kernel module of the package, which is imported when numba must compile one of its functions.

    `module` is its name without that of the package, such as "time_steps.march_kernels".
    """
    if module not in _KERNEL_MODULES:
        name = f"patchfem.{module}"
        text = _find_source(module).read_text("utf-8")
        _KERNEL_MODULES[module] = KernelModule(name, text, partial(import_module, name))
    return _KERNEL_MODULES[module]


def _find_source(module: str) -> Path:
    """Return the file of a module of the package."""
    return PACKAGE_FOLDER.joinpath(*module.split(".")).with_suffix(".py")


def instantiate(module: str, replacements: dict[str, str | KernelModule]) -> KernelModule:
    """Return a kernel module in which other modules replace some of its imports.

    The source differs from the file in these imports only, so the line numbers of tracebacks are those of the file.

    Parameters
    ----------
    module : str
        Name of the module without that of the package.
    replacements : dict
        Name under which the module imports another one (`from . import other as name`) -> the module that replaces it,
        or its name without that of the package. It must have the same functions.

    Returns
    -------
    KernelModule

    Raises
    ------
    ValueError
        If the module does not import another one exactly once under one of these names.
    """
    names = []
    for alias, replacement in replacements.items():
        names.append((alias, getattr(replacement, "__name__", f"patchfem.{replacement}")))
    text = _replace_imports(module, tuple(names))
    imported = [other for other in replacements.values() if isinstance(other, KernelModule)]

    # Each new module would load its machine code (about 1 MB) again, in every run of a long sweep.
    name = f"{module}_{hash_text(text)}"
    if name not in _KERNEL_MODULES:
        _KERNEL_MODULES[name] = make_kernel_module(name, text, _find_source(module), imported)
    return _KERNEL_MODULES[name]


@cache
def _replace_imports(module: str, names: tuple[tuple[str, str], ...]) -> str:
    """Return the source of a module that imports others under some names; each is a pair of name and module.

    A bench and its error estimate ask for the same source ten times, and a search through it takes a millisecond.
    """
    text = _find_source(module).read_text("utf-8")
    for alias, name in names:
        text, count = re.subn(
            rf"(?m)^from \.[\w.]* import \w+ as {alias}$", f"import {name} as {alias}", text
        )
        if count != 1:
            raise ValueError(f"patchfem.{module} imports its part {alias} {count} times, not once")
    return text


def hash_text(text: str) -> str:
    """Return a hash of a text, 12 hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def make_kernel_module(module: str, text: str, file: Path, imported=()) -> KernelModule:
    """Return a kernel module with a given source.

    Parameters
    ----------
    module : str
        Name of the module without that of the package.
    text : str
        Source.
    file : Path
        File that tracebacks name.
    imported : sequence of KernelModule
        Modules that the source imports; they are imported before it.
    """
    name = f"patchfem.{module}"

    @cache
    def execute_source():
        """Execute the source, and return the module."""
        for kernel_module in imported:
            kernel_module.load_module()
        made = sys.modules[name] = module_from_spec(spec_from_loader(name, None))
        exec(compile(text, str(file), "exec"), made.__dict__)
        return made

    return KernelModule(name, text, execute_source)


def list_portable_codes() -> dict[str, bytes]:
    """Return the portable codes of the package for the present kernels by the names of their files of machine code.

    They check no index.
    """
    if os.environ.get("NUMBA_BOUNDSCHECK", "0") not in ("", "0"):
        return {}
    return read_portable_codes(hash_kernels())


@cache
def _report_compilation(report) -> None:
    """Report, once per callback, that numba compiles."""
    problem = use_cache_folder().problem
    duration = "which takes 10 to 30 s and is needed only once"
    if problem:
        duration = (
            f"which takes 10 to 30 s at every command because the compiled code cannot be kept: {problem}; set "
            "PATCHFEM_CACHE to another folder"
        )
    report(f"compiling the code of the simulation for this machine, {duration}")


def remove_old_folders(folder: Path) -> None:
    """Mark a folder of compiled code as used now; if it is new, remove those beside it that are no longer used.

    A process that has used one of them for longer goes on with the code that it has loaded. Folders that cannot be
    removed stay too.
    """
    with suppress(OSError):
        is_new = not any(folder.iterdir())
        os.utime(folder)
        for entry in os.scandir(folder.parent) if is_new else ():
            is_code = re.fullmatch(r"[0-9a-f]{16}", entry.name)
            if not is_code or not entry.is_dir(follow_symlinks=False):
                continue
            if time() - entry.stat().st_mtime > MAX_UNUSED_SECONDS:
                shutil.rmtree(entry.path, ignore_errors=True)
