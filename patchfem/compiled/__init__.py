"""Compiled kernels and the cache of their machine code, one folder per state of the sources.

`load_compiled_module` returns a kernel module by name as a `KernelModule`, and `instantiate` returns a variant of it in
which some imports are replaced. The module, and with it numba, is imported only if a function is called whose machine
code is not stored.
`jit` contains the decorator `njit` of all kernels, `machine` compiles, stores and loads machine code, `portable` has code
that needs no numba. Where `machine` cannot store a function, numba stores it in the same folder. Read
`load_compiled_module`, `instantiate` and `KernelFunction` first.

The cache of numba detects a change of the file of a function, but not of the modules whose functions it calls, and it
stores no function that takes another function as an argument. So the folder is named by a hash of all kernel sources,
and a loop for any friction law is written out once per law by `instantiate`, with the import of the law replaced.

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
from functools import cache
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location, spec_from_loader
from pathlib import Path
from threading import RLock
from time import monotonic, process_time, sleep, time

from .. import cost_model
from ..disk import user_cache
from ..disk.installed import find_package_version
from ..disk.lock import lock_file
from . import machine
from .portable import read_portable_codes

# Names that other folders use, by module.
PUBLIC = {
    "flags_kernels": (
        "FASTMATH_FLAGS",
        "NJIT_CALL",
        "NJIT_KERNEL",
    ),
    "jit": (
        "NJIT_NO_REFCOUNT",
        "njit",
    ),
}

PACKAGE_FOLDER = Path(__file__).parents[1]  # folder of the package
# Modules of tuples that kernels take and of row numbers; they belong to the hash because the
# machine code depends on the order of the fields and on the numbers.
TUPLE_MODULES = (
    "contact/set_arrays.py",
    "hybrid/records.py",
    "points/case_rows.py",
    "points/law_rows.py",
)
CACHE_FOLDER_PATTERN = re.compile(r"[0-9a-f]{16}")
# Largest number of folders of compiled code, 0.5 MB to 20 MB each, besides the one in use. Every edit of a kernel, every
# release and every kind of CPU makes another one; several may share a home folder.
MAX_OTHER_CACHE_FOLDERS = 8
# Smallest time [s] since the last start of a process with a folder that is removed: a day.
MIN_UNUSED_SECONDS = 86400.0
# State of the environment variable that makes numba run all kernels as Python.
IS_JIT_DISABLED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
# Time to wait for another process that compiles [s]: ten times the longest compilation.
MAX_LOCK_WAIT_SECONDS = 300.0
# Time between two attempts to take the lock [s], short compared with a compilation.
LOCK_CHECK_SECONDS = 0.05
# Functions called by this process whose machine code cannot be stored, so that every
# process imports numba for them.
UNCACHED_FUNCTIONS = set()
# Lock that lets one thread at a time load code, because loading a function twice at the
# same time crashes the process.
CODE_LOADING_LOCK = RLock()
# Converter of the arguments of all functions, because several functions get the same tuples in turn.
CONVERTER = machine.ArgumentConverter()
REPORT = [None]  # callback of the last run, which receives a message if numba compiles a function


def hash_kernels() -> str:
    """Return the hash of all kernels, of the tuples that they take and of their compiler."""
    compiler = ("integer_enums.py", "jit.py", "machine.py", "pass_by_reference.py")
    sources = [PACKAGE_FOLDER / "compiled" / name for name in compiler]
    sources += sorted(PACKAGE_FOLDER.rglob("*kernels.py"))
    sources += sorted((PACKAGE_FOLDER / "hybrid" / "laws").glob("*.py"))
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
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    # The flags are needed because a virtual machine may hide some instruction sets of a CPU model.
    names = ("model name", "flags", "Features")
    descriptions = [line for line in dict.fromkeys(lines) if line.startswith(names)]
    return " ".join(descriptions) or platform.processor()


def cache_folder() -> Path:
    """Return the folder of compiled code for this state of the kernels.

    It lies in the user's cache. If that belongs to another user or cannot be written, it lies in the folder of the
    session (XDG_RUNTIME_DIR), or else in a folder of this process alone.
    """
    return _choose_folder()[0]


def explain_cache_folder() -> str:
    """Return the reason why `cache_folder` is not in the user's cache; "" if it is."""
    return _choose_folder()[1]


@cache
def _choose_folder_once() -> tuple[Path, str]:
    """Return what `_choose_folder` returned at the first call in this process."""
    return _choose_folder()


def _choose_folder() -> tuple[Path, str]:
    """Return the cache folder, and the reason why it is not in the user's cache; "" if it is."""
    session = os.environ.get("XDG_RUNTIME_DIR")
    name = Path("patchfem") / compute_kernel_key()
    user_folder = user_cache.find_cache_base() / name
    reason = user_cache.prepare_folder(user_folder)
    if not reason:
        return user_folder, ""
    if session and not user_cache.prepare_folder(Path(session) / name):
        return Path(session) / name, reason
    process_folder = user_cache.make_process_folder() / name
    user_cache.prepare_folder(process_folder)  # creates the folder if possible
    return process_folder, reason


class KernelModule:
    """Kernel module that is imported when it is needed.

    Its attributes are compiled functions (`KernelFunction`), whose names are read from the source. Any other attribute
    imports the module.

    Parameters
    ----------
    name : str
        Full name of the module.
    source : Path or str
        Its file, or its text if it has no file.
    importer : callable
        Function without arguments that imports the module and returns it.
    """

    def __init__(self, name: str, source: Path | str, importer):
        self.__name__ = name
        self._source = source
        self._importer = importer
        self._functions = {}

    def __getattr__(self, name: str):
        """Return a KernelFunction of the module, which is imported for other names."""
        if name.startswith("__"):
            raise AttributeError(f"{self.__name__} has no {name}")
        if name not in self._functions:
            if name not in _list_functions(self._source):
                return getattr(self.load_module(), name)
            file_prefix = f"{self.__name__.removeprefix('patchfem.')}.{name}-"
            self._functions[name] = KernelFunction(self, name, file_prefix)
        return self._functions[name]

    @property
    def is_vectorised(self) -> bool:
        """Whether loops of the module may become vector instructions; its constant IS_VECTORISED, by default True."""
        return "\nIS_VECTORISED = False" not in _read_text(self._source)

    def load_module(self):
        """Import the module and return it."""
        _prepare_cache()
        return self._importer()


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
            sleep(LOCK_CHECK_SECONDS)
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
    file_prefix : str
        Start of the names of its files of machine code; a hash of the argument types follows.
    """

    def __init__(self, module: KernelModule, name: str, file_prefix: str):
        self.module = module
        self.name = name
        self.file_prefix = file_prefix
        # Loaded function for each tuple of type codes; False if numba runs the function itself.
        self.loaded_functions = {}

    def __call__(self, *arguments):
        if IS_JIT_DISABLED:
            return self.get_dispatcher()(*arguments)
        try:
            type_codes, words = zip(*map(CONVERTER.convert, arguments))
        except machine.UnsupportedError:
            UNCACHED_FUNCTIONS.add(self.file_prefix[:-1])
            return self.get_dispatcher()(*arguments)
        function = self.loaded_functions.get(type_codes)
        if function is None:
            with CODE_LOADING_LOCK:
                # Another thread may have loaded it in the meantime.
                function = self.loaded_functions.get(type_codes)
                if function is None:
                    return self._call_first_time(type_codes, words, arguments)
        return function(b"".join(words)) if function else self.get_dispatcher()(*arguments)

    def _make_file_name(self, type_codes) -> str:
        """Return the name of the file with the code for arguments of these types."""
        return f"{self.file_prefix}{hash_text(','.join(type_codes))}.code"

    def _call_first_time(
        self, type_codes: tuple[str, ...], words: tuple[bytes, ...], arguments: tuple[object, ...]
    ):
        """Load or compile the code for arguments of these types, and return the result of the call.

        `words` are the arguments as machine words, one entry for each.
        """
        path = _prepare_cache() / "code" / self._make_file_name(type_codes)
        function = machine.load_file(path)
        if function is None:
            with measure_compile_time():
                function = self._build_machine_code(path, arguments)
        if function is None:
            with measure_compile_time(), pause_garbage_collection():
                result = self.get_dispatcher()(*arguments)
            UNCACHED_FUNCTIONS.add(self.file_prefix[:-1])
            self.loaded_functions[type_codes] = False
            return result
        self.loaded_functions[type_codes] = function
        return function(b"".join(words))

    def _build_machine_code(self, path: Path, arguments: tuple[object, ...]):
        """Compile code for arguments of these types into the file `path`, or load it from there.

        It is there if another process has compiled it. Portable code of the package needs no numba. Returns None if the
        function cannot be compiled in this way.
        """
        with lock_exclusively(path.with_suffix(".lock")):
            function = machine.load_file(path)
            if function is None:
                portable_code = list_portable_codes().get(path.name, b"")
                function = machine.compile_for_this_cpu(path, portable_code)
            if function is None:
                if REPORT[0] is not None:
                    _report_compilation(REPORT[0])
                with pause_garbage_collection():
                    compiler = import_module(f"{__name__}.jit").compile_unoptimised  # imports numba
                    function = machine.compile_function(
                        path,
                        self.get_dispatcher(),
                        arguments,
                        compiler,
                        is_vectorised=self.module.is_vectorised,
                    )
        return function

    def get_dispatcher(self):
        """Return the dispatcher of the function, which numba compiles or loads from its cache."""
        function = getattr(self.module.load_module(), self.name)
        return function.get_standalone() if hasattr(function, "get_standalone") else function


def _read_text(source: Path | str) -> str:
    """Return the text of a module from its file or its text."""
    return source.read_text("utf-8") if isinstance(source, Path) else source


@cache
def _list_functions(source: Path | str) -> set[str]:
    """Return the names of the compiled functions of a module from its source."""
    return set(re.findall(r"(?m)^@njit\b[^@]*?^def (\w+)", _read_text(source)))


def load_compiled_module(module: str, report=None):
    """Load a module of the package, whose compiled code is cached on disk.

    Parameters
    ----------
    module : str
        Name of the module without that of the package, such as "time_steps.march_kernels".
    report : callable or None
        Callback that receives a message if numba compiles a function.

    Returns
    -------
    KernelModule or module
        A `KernelModule` if the name ends with "kernels".
    """
    _prepare_cache(report)
    if module.endswith("kernels"):
        return get_kernel_module(module)
    return import_module(f"patchfem.{module}")


@cache
def get_kernel_module(module: str) -> KernelModule:
    """Return the kernel module of this name without importing it."""
    name = f"patchfem.{module}"
    return KernelModule(name, _find_source(module), lambda: import_module(name))


def _find_source(module: str) -> Path:
    """Return the file of a module of the package."""
    return PACKAGE_FOLDER.joinpath(*module.split(".")).with_suffix(".py")


_KERNEL_MODULES = {}  # `KernelModule` for each name that `instantiate` has made


def instantiate(
    module: str, replacements: dict[str, str | KernelModule], report=None
) -> KernelModule:
    """Write a kernel module in which other modules replace some of its imports.

    The source differs from the file in these imports only, so the line numbers of tracebacks are those of the file. It is
    written atomically into the folder of the compiled code, under a name with the hash of its content, because several
    processes may need it at the same time and the package may be read-only.

    Parameters
    ----------
    module : str
        Name of the module without that of the package.
    replacements : dict
        Name under which the module imports another one (`from . import other as name`) -> the module that replaces it,
        or its name without that of the package. It must have the same functions.
    report : callable or None
        Callback that receives a message if numba compiles a function.

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
        _KERNEL_MODULES[name] = write_kernel_module(name, text, report, imported)
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


def write_kernel_module(module: str, text: str, report=None, imported=()) -> KernelModule:
    """Write the source of a kernel module into the cache folder, and return the module.

    Parameters
    ----------
    module : str
        Name of the module without that of the package.
    text : str
        Source.
    report : callable or None
        Callback that receives a message if numba compiles a function.
    imported : sequence of KernelModule
        Modules that the source imports; they are imported before it.

    Returns
    -------
    KernelModule
    """
    name = f"patchfem.{module}"
    path = _prepare_cache(report) / "instances" / f"{module}.py"
    data = text.encode()
    is_stored = _read_bytes(path) == data or user_cache.write_cache_file(path, data)

    def import_written_module():
        """Import the module from its file, or execute its text if the file cannot be written."""
        if name in sys.modules:
            return sys.modules[name]
        for kernel_module in imported:
            kernel_module.load_module()
        spec = spec_from_file_location(name, path) if is_stored else spec_from_loader(name, None)
        sys.modules[name] = module_from_spec(spec)
        if is_stored:
            spec.loader.exec_module(sys.modules[name])
        else:
            exec(compile(text, str(path), "exec"), sys.modules[name].__dict__)
        return sys.modules[name]

    return KernelModule(name, path if is_stored else text, import_written_module)


def list_portable_codes() -> dict[str, bytes]:
    """Return the portable codes of the package for the present kernels by the names of their files of machine code.

    They check no index.
    """
    if os.environ.get("NUMBA_BOUNDSCHECK", "0") not in ("", "0"):
        return {}
    return read_portable_codes(hash_kernels())


def _read_bytes(path: Path) -> bytes | None:
    """Return the content of the file `path`, or None if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError:
        return None


def _prepare_cache(report=None) -> Path:
    """Set the cache folder for numba too, and return it.

    The callback `report` receives a message, once per process, if numba compiles a function.
    """
    if report is not None:
        REPORT[0] = report
    return set_cache_folder()


@cache
def set_cache_folder() -> Path:
    """Return the cache folder, and make numba and child processes use it."""
    folder, reason = _choose_folder_once()
    if reason:
        os.environ["PATCHFEM_CACHE"] = str(folder.parents[1])  # for child processes
    else:
        remove_old_folders(folder)
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    return folder


@cache
def _report_compilation(report) -> None:
    """Report, once per callback, that numba compiles."""
    reason = _choose_folder_once()[1]
    duration = "which takes 10 to 30 s and is needed only once"
    if reason:
        duration = (
            f"which takes 10 to 30 s at every command because the compiled code cannot be kept: {reason}; set "
            "PATCHFEM_CACHE to another folder"
        )
    report(f"compiling the code of the simulation for this machine, {duration}")


def remove_old_folders(folder: Path, max_others: int = MAX_OTHER_CACHE_FOLDERS) -> None:
    """Mark a folder of compiled code as used now; if it is new, remove the least recently used ones beside it.

    The `max_others` most recently used ones and those used in the last day stay. A process that has used one of the
    removed folders for longer goes on with the code that it has loaded. Folders that cannot be removed stay too.
    """
    with suppress(OSError):
        is_new = not any(folder.iterdir())
        os.utime(folder)
        if not is_new:
            return
        others = {}
        for entry in os.scandir(folder.parent):
            is_code = CACHE_FOLDER_PATTERN.fullmatch(entry.name) and entry.name != folder.name
            if is_code and entry.is_dir(follow_symlinks=False):
                others[entry.path] = entry.stat().st_mtime
        for other in sorted(others, key=others.get, reverse=True)[max_others:]:
            if time() - others[other] > MIN_UNUSED_SECONDS:
                shutil.rmtree(other, ignore_errors=True)
