"""Compiled kernels and the cache of their machine code, one folder per state of the sources.

`load` returns a kernel module by name as a `Kernels` object, and `instance` returns a variant of it in which some
imports are replaced. The module, and with it numba, is imported only if a function is called whose machine code is not
stored. `jit` contains the decorator `njit` of all kernels, `machine` stores and loads machine code, `no_jit` runs
kernels as Python, `prebuilt` finds the machine code of a wheel, `cache_files` and `cache_limit` manage the cache. Read
`load`, `instance` and `Entry` first.

The cache of numba detects a change of the file of a function, but not of the modules whose functions it calls, and it
stores no function that takes another function as an argument. So the folder is named by a hash of all kernel sources,
and a loop for any friction law is written out once per law by `instance`, with the import of the law replaced.

NUMBA_DISABLE_JIT=1 runs every kernel as Python for debuggers and coverage tools. NUMBA_BOUNDSCHECK=1 compiles all
kernels again with checks of every index. If the caller of a function predicts its cost as Python (`Entry.expect`), the
function runs as Python as long as this is cheaper than compiling it.

The optimisation level is 3, the default of numba. Levels 2 and 1 save no compile time: the rig and five laws took 64
and 61 CPU seconds instead of 63, most of it in the Python code of numba. At level 2 the loop of Iwan's law takes 10.1
ms instead of 7.9 ms.
"""

import ast
import gc
import hashlib
import os
import platform
import re
import sys
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location, spec_from_loader
from math import inf
from operator import add, mul, neg, pos, sub, truediv
from pathlib import Path
from threading import RLock
from time import monotonic, sleep

import numpy as np

from ..disk import user_cache
from ..disk.atomic_write import describe_space_shortage
from ..disk.installed import find_package_version
from . import cache_limit, machine, prebuilt
from .no_jit import plain

HERE = Path(__file__).parents[1]  # folder of the package
# Modules of tuples that kernels take. They belong to the hash because the machine code depends on the field order.
TUPLES = (
    "contact/batch/arrays.py",
    "contact/set_arrays.py",
    "dynamics/interfaces/arrays.py",
    "dynamics/smooth/arrays.py",
    "dynamics/events/modal_system.py",
    "dynamics/events/elements.py",
)
# Numba's environment variable that disables compilation; all kernels then run as Python.
PLAIN = os.environ.get("NUMBA_DISABLE_JIT", "0") not in (
    "",
    "0",
)
LEAST = 1 << 21  # bytes; the machine code of a run needs this disk space
# CPU seconds; a function that would take longer as Python in this process is compiled. This is about a tenth of the
# compile time (10 to 30 s), because later processes reuse the machine code.
PATIENCE = 2.0
# Maximum time [s] to wait for another process that compiles, ten times the longest compilation; interval [s] of checks.
WAIT, LOOK = (
    300.0,
    0.05,
)
# Functions called by this process whose machine code cannot be stored, so every process imports numba for them.
UNKEPT = set()
# One thread at a time loads code, because loading a function twice at the same time crashes the process.
LOADING = RLock()
_LISTENERS = []  # callbacks that receive a message when a function is compiled
ARITHMETIC = {
    ast.Add: add,
    ast.Sub: sub,
    ast.Mult: mul,
    ast.Div: truediv,
    ast.Pow: pow,
    ast.USub: neg,
    ast.UAdd: pos,
}


def sources():
    """Return the hash object of all kernels, of the tuples that they take and of their compiler."""
    digest = hashlib.sha256()
    for source in (
        *(HERE / "compiled" / name for name in ("jit.py", "pass_by_reference.py")),
        *sorted(HERE.rglob("*kernels.py")),
        *(HERE / name for name in TUPLES),
    ):
        digest.update(str(source.relative_to(HERE)).encode() + b"\0" + source.read_bytes())
    return digest


def kernel_key() -> str:
    """Return a hash of the kernels, the versions of numba and llvmlite, and the CPU."""
    digest = sources()
    checked = os.environ.get("NUMBA_BOUNDSCHECK", "")
    made_by = f"{find_package_version('numba')} {find_package_version('llvmlite')} {sys.version_info[:2]} {checked}"
    digest.update(f"{made_by} {platform.machine()} {_cpu()}".encode())
    return digest.hexdigest()[:16]


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    # the flags are needed because a virtual machine may hide some instruction sets of a CPU model
    found = [
        line
        for line in dict.fromkeys(lines)
        if line.startswith(("model name", "flags", "Features"))
    ]
    return " ".join(found) or platform.processor()


def cache_folder() -> Path:
    """Return the folder of compiled code for this state of the kernels.

    It lies in the user's cache. If that belongs to another user or cannot be written, it lies in the folder of the
    session (XDG_RUNTIME_DIR), or else in a folder of this process alone.
    """
    return _place()[0]


def why_elsewhere() -> str:
    """Return the reason why `cache_folder` is not in the user's cache; "" if it is."""
    return _place()[1]


@cache
def _placed() -> tuple[Path, str]:
    """Return the folder for this process, and the reason why it is not in the user's cache."""
    return _place()


def _place() -> tuple[Path, str]:
    session, name = os.environ.get("XDG_RUNTIME_DIR"), Path("patchfem") / kernel_key()
    first = user_cache.prepare_folder(user_cache.find_cache_base() / name)
    if not first:
        return user_cache.find_cache_base() / name, ""
    if session and not user_cache.prepare_folder(Path(session) / name):
        return Path(session) / name, first
    user_cache.prepare_folder(user_cache.make_process_folder() / name)  # makes it if possible
    return user_cache.make_process_folder() / name, first


class Kernels:
    """Kernel module that is imported when it is needed.

    Its attributes are compiled functions (`Entry`) and constants, which are read from the source without an import. Any
    other attribute imports the module.
    """

    def __init__(self, name: str, text: Path | str, bring):
        self.__name__, self._text, self._bring, self._entries = name, text, bring, {}

    def __getattr__(self, name: str):
        if name.startswith("__"):
            raise AttributeError(f"{self.__name__} has no {name}")
        if name not in self._entries:
            constants, functions = _names(self._text)
            if name in constants:
                return constants[name]
            if name not in functions:
                return getattr(self.module(), name)
            self._entries[name] = Entry(
                self, name, f"{self.__name__.removeprefix('patchfem.')}.{name}-"
            )
        return self._entries[name]

    def module(self):
        """Import the module and return it."""
        _prepared()
        return self._bring()


SPENT = [0.0]  # s; time in which this process compiled code or waited for another process that did


@contextmanager
def spending():
    """Add the time of the block to `SPENT`."""
    begin = monotonic()
    try:
        yield
    finally:
        SPENT[0] += monotonic() - begin


@contextmanager
def tidied_later():
    """Pause the garbage collection in the block; it takes a seventh of the compile time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


@contextmanager
def alone(path: Path):
    """Let one process at a time run the block, by a lock on a file.

    The operating system releases the lock if the process is killed.
    Other processes wait for at most `WAIT` seconds, because the lock of a machine that has disappeared may remain on a
    network file system. On a file system without locks no process waits.
    """
    try:
        import fcntl

        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        file = os.open(path, os.O_CREAT | os.O_RDWR, 0o600)
    except (ImportError, OSError):  # Windows; a folder that cannot be written
        yield
        return
    try:
        end = monotonic() + WAIT
        while monotonic() < end:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                sleep(LOOK)
            except OSError:
                break
        yield
    finally:
        os.close(file)


class Entry:
    """Function of a kernel module.

    A call runs its stored machine code. If there is none, numba compiles the function, or it runs as Python if its
    predicted cost is small.
    """

    def __init__(self, home: Kernels, name: str, kept: str):
        self.home, self.name, self.kept = home, name, kept
        self.words, self.codes, self.as_python = machine.Words(), {}, inf

    def expect(self, seconds: float) -> None:
        """Add the predicted cost of calls as Python [CPU s].

        The estimate must be the same in every process, so that all of them choose the same form of the function.
        """
        self.as_python = seconds + (self.as_python if self.as_python < inf else 0.0)

    def is_kept(self, *arguments) -> bool:
        """Return whether machine code for arguments of these types is stored."""
        kinds = ",".join(self.words.of(argument)[0] for argument in arguments)
        return any(
            (folder / "code" / f"{self.kept}{digest(kinds)}.code").is_file() for folder in _kept()
        )

    def held(self, *arguments) -> tuple:
        """Convert the last arguments of many calls once, for `call_with_bound_args`.

        They must be the same objects in every call, but the content of their arrays may change.

        Returns
        -------
        tuple
            Type codes, words and the arguments themselves. The type codes are None if there are no words.
        """
        if PLAIN:
            return None, b"", arguments
        try:
            kinds, words = zip(*map(self.words.of, arguments))
        except machine.Unfit:
            return None, b"", arguments
        return kinds, b"".join(words), arguments

    def call_with_bound_args(self, held: tuple, *first):
        """Call the function with first arguments and the last arguments that `held` has converted."""
        kinds, words, last = held
        if kinds is None:
            return self(*first, *last)
        own, mine = zip(*map(self.words.of, first))
        code = self.codes.get(own + kinds)
        return code(b"".join(mine) + words) if code else self(*first, *last)

    def __call__(self, *arguments):
        if PLAIN:
            return self.function()(*arguments)
        try:
            kinds, words = zip(*map(self.words.of, arguments))
        except machine.Unfit:
            UNKEPT.add(self.kept[:-1])
            return self.function()(*arguments)
        code = self.codes.get(kinds)
        if code is None:
            with LOADING:
                code = self.codes.get(kinds)  # another thread may have loaded it in the meantime
                if code is None:
                    return self._first(kinds, words, arguments)
        return code(b"".join(words)) if code else self.function()(*arguments)

    def _first(self, kinds: tuple, words: tuple, arguments: tuple):
        """Load or compile the code for arguments of these types, and return the result of the call."""
        path = _prepared() / "code" / f"{self.kept}{digest(','.join(kinds))}.code"
        code = machine.found(path) or _generic(path)
        if code is None and self.as_python <= PATIENCE:
            with np.errstate(all="ignore"):
                return getattr(plain(self.home.__name__), self.name)(*arguments)
        if code is None:
            with spending():
                code = self._made(path, arguments)
        if code is None:
            with spending(), tidied_later():
                answer = self.function()(*arguments)
                if not machine.keep(path, self.function(), arguments):
                    UNKEPT.add(self.kept[:-1])
            self.codes[kinds] = False
            return answer
        self.codes[kinds] = code
        return code(b"".join(words))

    def _made(self, path: Path, arguments: tuple):
        """Compile code for arguments of these types, or load it if another process has compiled it.

        Returns None if the function cannot be compiled in this way.
        """
        with alone(path.with_suffix(".lock")):
            code = machine.found(path)
            if code is None:
                _tell()
                with tidied_later():
                    optimised = import_module(f"{__name__}.jit").optimised  # imports numba
                    code = machine.make(path, self.function(), arguments, optimised)
        return code

    def function(self):
        """Return the dispatcher of the function, which numba compiles or loads from its cache."""
        function = getattr(self.home.module(), self.name)
        return function.alone() if hasattr(function, "alone") else function

    def __getattr__(self, name: str):
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.function(), name)


@cache
def _names(text: Path | str) -> tuple:
    """Read the constants and the names of the compiled functions of a module from its source."""
    out, functions = {}, set()
    for line in ast.parse(text.read_text("utf-8") if isinstance(text, Path) else text).body:
        if isinstance(line, ast.FunctionDef) and any(
            "njit" in ast.unparse(one) for one in line.decorator_list
        ):
            functions.add(line.name)
        if isinstance(line, ast.Assign) and len(line.targets) == 1:
            try:
                value, target = _value(line.value, out), line.targets[0]
            except KeyError:
                continue
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            values = value if isinstance(target, ast.Tuple) else [value]
            out |= {name.id: one for name, one in zip(names, values) if isinstance(name, ast.Name)}
    return out, functions


def _value(node: ast.expr, names: dict):
    """Evaluate an expression of constants, known names, arithmetic and ranges.

    Raises KeyError for any other expression.
    """
    match node:
        case ast.Constant():
            return node.value
        case ast.Name():
            return names[node.id]
        case ast.Tuple():
            return tuple(_value(one, names) for one in node.elts)
        case ast.Call(ast.Name("range"), given, []):
            return tuple(range(*(_value(one, names) for one in given)))
        case ast.UnaryOp():
            return ARITHMETIC[type(node.op)](_value(node.operand, names))
        case ast.BinOp():
            return ARITHMETIC[type(node.op)](_value(node.left, names), _value(node.right, names))
    raise KeyError(ast.unparse(node))


def load(module: str, say=None):
    """Load a module of the package, whose compiled code is cached on disk.

    `module` is its name without that of the package, such as "dynamics.modal_kernels". A module named *kernels is
    returned as `Kernels`. The callback `say` receives a message if the cache is empty, so the code must be compiled.
    """
    _prepared(say)
    return kernels(module) if module.endswith("kernels") else import_module(f"patchfem.{module}")


@cache
def kernels(module: str) -> Kernels:
    """Return the kernel module of this name without importing it."""
    name = f"patchfem.{module}"
    return Kernels(
        name, HERE.joinpath(*module.split(".")).with_suffix(".py"), lambda: import_module(name)
    )


def instance(module: str, parts: dict, say=None):
    """Write a kernel module in which other modules replace some of its imports.

    The source differs from the file in these imports only, so the line numbers of tracebacks are those of the file. It is
    written atomically into the folder of the compiled code, under a name with the hash of its content, because several
    processes may need it at the same time and the package may be read-only.

    Parameters
    ----------
    module : str
        Name as in `load`.
    parts : dict
        Name under which the module imports another one (`from . import other as name`) -> the module that replaces it,
        or its name as in `load`. It must have the same functions.
    say : callable or None
        Callback as in `load`.

    Returns
    -------
    Kernels

    Raises
    ------
    ValueError
        If the module does not import a part exactly once under this name.
    """
    text = HERE.joinpath(*module.split(".")).with_suffix(".py").read_text("utf-8")
    for part, other in parts.items():
        name = other.__name__ if hasattr(other, "__name__") else f"patchfem.{other}"
        text, count = re.subn(
            rf"(?m)^from \.[\w.]* import \w+ as {part}$", f"import {name} as {part}", text
        )
        if count != 1:
            raise ValueError(f"patchfem.{module} imports its part {part} {count} times, not once")
    return written(
        f"{module}_{digest(text)}",
        text,
        say,
        [one for one in parts.values() if isinstance(one, Kernels)],
    )


def digest(text: str) -> str:
    """Return a short hash of a string."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def written(module: str, text: str, say=None, parts=()):
    """Write the source of a kernel module into the cache folder, and return it as `Kernels`.

    Parameters
    ----------
    module : str
        Name as in `load`.
    text : str
    say : callable or None
        Callback as in `load`.
    parts : sequence of Kernels
        Modules that the source imports; they are imported before it.

    Returns
    -------
    Kernels
    """
    name = f"patchfem.{module}"
    path, data = _prepared(say) / "instances" / f"{module}.py", text.encode()
    kept = _bytes_of(path) == data or user_cache.write_cache_file(path, data)

    def bring():
        if name not in sys.modules:
            for part in parts:
                part.module()
            spec = spec_from_file_location(name, path) if kept else spec_from_loader(name, None)
            sys.modules[name] = module_from_spec(spec)
            if kept:
                spec.loader.exec_module(sys.modules[name])
            else:  # without a file, the module exists only in this process
                exec(compile(text, str(path), "exec"), sys.modules[name].__dict__)
        return sys.modules[name]

    return Kernels(name, path if kept else text, bring)


def ran(kind: str) -> None:
    """Record that a run of this kind was completed, so its compiled code is stored."""
    if not PLAIN:
        user_cache.write_cache_file(_folder() / "kinds" / digest(kind), kind.encode())


def has_run(kind: str) -> bool:
    """Return whether a run of this kind needs no compilation, since one was completed before."""
    return PLAIN or any((one / "kinds" / digest(kind)).is_file() for one in _kept())


def _kept(own_code: Path | None = None) -> list:
    """List the folders of compiled code: that of this machine and, if any, that of the wheel."""
    return [own_code or _placed()[0], *filter(None, [prebuilt.folder(sources)])]


def _generic(path: Path) -> machine.Code | None:
    """Load the code from the file of this name in the wheel; return None if there is none."""
    found = prebuilt.folder(sources)
    return found and machine.found(found / "code" / path.name)


def _bytes_of(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None


def _prepared(say=None) -> Path:
    """Set the cache folder for numba too, and return it.

    The callback `say` receives a message, once per process, if the folder is empty.
    """
    folder = _folder()
    if say is not None:
        _told(say)
    return folder


@cache
def _folder() -> Path:
    folder, elsewhere = _placed()
    if elsewhere:
        os.environ["PATCHFEM_CACHE"] = str(folder.parents[1])  # for child processes
    else:
        cache_limit.mark_used(folder)
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    return folder


def when_compiling(say) -> None:
    """Register a callback that receives the message of `load` when a function is compiled."""
    if say is not None:
        _LISTENERS[:] = [say]


def _tell() -> None:
    for say in _LISTENERS:
        _told(say)


@cache
def _told(say) -> None:
    if not PLAIN and not any(
        any(one.rglob(f"*.{ending}")) for one in _kept(_folder()) for ending in ("code", "nbi")
    ):
        why = _placed()[1] or describe_space_shortage(_folder() / "code", LEAST)
        say(
            "compiling the code of the simulation for this machine, "
            + (
                f"which takes 10 to 30 s at every command because the compiled code cannot be kept: {why}; set "
                "PATCHFEM_CACHE to another folder"
                if why
                else "which takes 10 to 30 s and is needed only once"
            )
        )
