"""Compiled functions of the package and their files, kept in one folder per state of the kernel sources.

In: the name of a module of kernels, and modules to exchange in it. Out: a `Kernels`, which imports the module, and with
it numba, only if a function is called whose machine code is not stored yet. `jit` has the decorator `njit` of all
kernels, `machine` stores and loads machine code, `no_jit` runs kernels as Python, `prebuilt` finds the code of a wheel,
`cache_files` and `cache_limit` keep the folders. Read `load`, `instance` and `Entry` first.

The cache of numba notices a change of the file of a function, but not of the files that it calls, and it stores no
function that takes another function as an argument. So the folder is named by a hash of all kernel sources, and a loop
for any friction law is written out once per law by `instance`, with the import of the law exchanged.

NUMBA_DISABLE_JIT=1 runs every kernel as Python, so that debuggers and coverage see its lines. NUMBA_BOUNDSCHECK=1
compiles all kernels anew and checks every index. A function whose caller estimates its cost as Python (`Entry.expect`)
runs as Python while the cost is small, because compiling takes longer.

The optimisation level is 3, the default of numba. Levels 2 and 1 save no compile time: the rig and five laws took 64
and 61 CPU seconds instead of 63, most of it in the Python of numba. At level 2 the loop of Iwan's law takes 10.1 ms
instead of 7.9 ms.
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

HERE = Path(__file__).parents[1]  # the package
# tuples that kernels take: numba's cache would not notice two of their fields that change places
TUPLES = (
    "contact/batch/arrays.py",
    "contact/set_arrays.py",
    "dynamics/interfaces/arrays.py",
    "dynamics/smooth/arrays.py",
    "dynamics/events/modal_system.py",
    "dynamics/events/elements.py",
)
# numba's own switch: all runs as the Python it is
PLAIN = os.environ.get("NUMBA_DISABLE_JIT", "0") not in (
    "",
    "0",
)
LEAST = 1 << 21  # bytes of the machine code of a run
PATIENCE = 2.0  # CPU seconds of a function as Python in a process, from which on it is compiled: a tenth of that
# s that a process waits at most for what another compiles: ten times the largest; how often
WAIT, LOOK = (
    300.0,
    0.05,
)
# functions called here whose machine code cannot be kept: every process brings up numba for them
UNKEPT = set()
# one thread at a time brings code: two that load the same function at once end the process
LOADING = RLock()
_LISTENERS = []  # who is told when something is compiled
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
    """Return the hash object of all kernels of the package, of the tuples that they take and of their compiler."""
    digest = hashlib.sha256()
    for source in (
        *(HERE / "compiled" / name for name in ("jit.py", "pass_by_reference.py")),
        *sorted(HERE.rglob("*kernels.py")),
        *(HERE / name for name in TUPLES),
    ):
        digest.update(str(source.relative_to(HERE)).encode() + b"\0" + source.read_bytes())
    return digest


def kernel_key() -> str:
    """Return a hash of the kernels, of numba and llvmlite, and of the CPU with its instruction sets."""
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
    # the same model offers fewer instructions where a virtual machine hides some
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
    user_cache.prepare_folder(user_cache.make_process_folder() / name)  # makes it where it can
    return user_cache.make_process_folder() / name, first


class Kernels:
    """Module of compiled code that is imported when it is needed.

    An attribute is a function to call or a constant, both read from the text of the module; for any other attribute the
    module is imported.
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


SPENT = [0.0]  # s for which this process compiled code, or waited for another process that did


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
    """Pause the search for cyclic garbage in the block, which takes a seventh of the time of a compilation."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


@contextmanager
def alone(path: Path):
    """Let one process at a time run the block, by a lock on a file, which the system releases if the process is killed.

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
    """Function of a module of compiled code.

    A call runs its stored machine code. If there is none, numba compiles the function, or it runs as Python while that
    costs little.
    """

    def __init__(self, home: Kernels, name: str, kept: str):
        self.home, self.name, self.kept = home, name, kept
        self.words, self.codes, self.as_python = machine.Words(), {}, inf

    def expect(self, seconds: float) -> None:
        """Announce calls that would take this time as Python [CPU s].

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
        """(kinds, words, arguments) of last arguments that stay the same objects from call to
        call, for `call_with_bound_args`:
        their words are made once. What is in their arrays may change."""
        if PLAIN:
            return None, b"", arguments
        try:
            kinds, words = zip(*map(self.words.of, arguments))
        except machine.Unfit:
            return None, b"", arguments
        return kinds, b"".join(words), arguments

    def call_with_bound_args(self, held: tuple, *first):
        """The function of some first arguments and those of `pass_by_reference`."""
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
                code = self.codes.get(kinds)  # another thread may have brought it meanwhile
                if code is None:
                    return self._first(kinds, words, arguments)
        return code(b"".join(words)) if code else self.function()(*arguments)

    def _first(self, kinds: tuple, words: tuple, arguments: tuple):
        """Return the result of the first call with arguments of these types, for which code is loaded or made."""
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
        """Return code compiled for arguments of these types, here or by another process in the meantime; None on failure."""
        with alone(path.with_suffix(".lock")):
            code = machine.found(path)
            if code is None:
                _tell()
                with tidied_later():
                    optimised = import_module(f"{__name__}.jit").optimised  # brings numba
                    code = machine.make(path, self.function(), arguments, optimised)
        return code

    def function(self):
        """Return the function of the module, which numba compiles or finds in its cache."""
        function = getattr(self.home.module(), self.name)
        return function.alone() if hasattr(function, "alone") else function

    def __getattr__(self, name: str):
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.function(), name)


@cache
def _names(text: Path | str) -> tuple:
    """Read the constants and the names of the compiled functions of a module from its text or its file."""
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
    """Evaluate an expression of constants, known names, arithmetic and ranges; raise KeyError for any other."""
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
    """Load a module of the package, such as "dynamics.modal_kernels", with its compiled code cached on disk.

    A module named *kernels is returned as `Kernels`. The callback `say` receives a message if nothing is stored yet, so
    that the code has to be compiled first.
    """
    _prepared(say)
    return kernels(module) if module.endswith("kernels") else import_module(f"patchfem.{module}")


@cache
def kernels(module: str) -> Kernels:
    """Return the module of compiled code of this name without importing it."""
    name = f"patchfem.{module}"
    return Kernels(
        name, HERE.joinpath(*module.split(".")).with_suffix(".py"), lambda: import_module(name)
    )


def instance(module: str, parts: dict, say=None):
    """Write out a module of compiled code with other modules in place of some of its imports.

    The text differs from the file in these imports only, so the line numbers of tracebacks are those of the file. It is
    written atomically into the folder of the compiled code, under a name with the hash of its content, because several
    processes may need it at the same time and the package may be read-only.

    Parameters
    ----------
    module : str
        Name as in `load`.
    parts : dict
        Name under which the module imports another one (`from . import other as name`) -> the module that takes its
        place, or its name as in `load`. It must have the same functions.
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
    """Return a short hash of a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def written(module: str, text: str, say=None, parts=()):
    """Write the text of a module into the folder of the compiled code, and return the module as `Kernels`.

    Parameters
    ----------
    module : str
        Name as in `load`.
    text : str
    say : callable or None
        Callback as in `load`.
    parts : sequence of Kernels
        Modules that the text imports; they are imported before it.

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
            else:  # it lives as long as the process
                exec(compile(text, str(path), "exec"), sys.modules[name].__dict__)
        return sys.modules[name]

    return Kernels(name, path if kept else text, bring)


def ran(kind: str) -> None:
    """Record that a run of this kind was completed, so that its compiled code is stored."""
    if not PLAIN:
        user_cache.write_cache_file(_folder() / "kinds" / digest(kind), kind.encode())


def has_run(kind: str) -> bool:
    """Return whether a run of this kind was completed with the present kernels, so that nothing has to be compiled."""
    return PLAIN or any((one / "kinds" / digest(kind)).is_file() for one in _kept())


def _kept(own_code: Path | None = None) -> list:
    """List the folders that may have compiled code: the one of this machine, and the one of the wheel."""
    return [own_code or _placed()[0], *filter(None, [prebuilt.folder(sources)])]


def _generic(path: Path) -> machine.Code | None:
    """Load the code of the wheel for a file of this name; None if there is none."""
    found = prebuilt.folder(sources)
    return found and machine.found(found / "code" / path.name)


def _bytes_of(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None


def _prepared(say=None) -> Path:
    """Return the folder of the compiled code, also for numba; `say` receives a message, once, if it is empty."""
    folder = _folder()
    if say is not None:
        _told(say)
    return folder


@cache
def _folder() -> Path:
    folder, elsewhere = _placed()
    if elsewhere:
        os.environ["PATCHFEM_CACHE"] = str(folder.parents[1])  # for processes that this one starts
    else:
        cache_limit.mark_used(folder)
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    return folder


def when_compiling(say) -> None:
    """Give `say` the message of `load`, but only when something is compiled."""
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
