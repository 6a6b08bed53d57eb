"""Where compiled code is kept: one folder per state of the kernel sources, so an edited law never runs as its old self.

Numba's own cache notices only a change of the file that holds the function, not of the files it calls. A function that
is handed another one as an argument is never cached at all, so a loop that should run with any law is a text of its own
per law: `instance` writes it beside the compiled code, with the import of the law exchanged.

Numba's own switches are obeyed: NUMBA_DISABLE_JIT=1 runs every kernel as the Python that it is written in (a debugger
or a measure of coverage sees each line), NUMBA_BOUNDSCHECK=1 compiles all anew and checks every index.

Numba's level of optimisation stays its own, 3. Compile CPU s of the rig, Iwan, Bouc-Wen, tanh,
LuGre and bonds at the levels 3, 2 and 1: 6.4 5.0 5.1, 23.0 24.3 21.8, 8.9 9.7 9.2, 7.8 8.5 7.8, 8.4
8.0 7.8, 8.8 8.9 9.0, in all 63, 64 and 61 on a busy machine, for most of it was numba's own Python.
Iwan's loop then takes 7.9, 10.1 and 10.0 ms, others up to a sixth more. Since tuples are taken by
their address (`pass_by_reference`) and only the passes run that are needed (`jit`), the loop from
event to event compiles in three fifths of the time: the first sweep of a Coulomb rig 13.5 CPU s,
21.9 before.

`jit` has the `njit` of all kernels. `load` and `instance` give `Kernels`, which import the module of compiled code,
and with it numba, only where a function of it is called whose machine code is not kept yet (`machine`). A function
whose caller says what its work would cost as Python (`Entry.expect`) runs as Python (`no_jit`) while that is little: a
short history is over long before its loop would be compiled.
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
from ..disk.atomic_write import space_shortage
from ..disk.installed import package_version
from . import cache_limit, machine, prebuilt
from .no_jit import plain

HERE = Path(__file__).parents[1]  # the package
# tuples that kernels take: numba's cache would not notice two of their fields that change places
TUPLES = (
    "contact/batch/arrays.py",
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
    """Hash, as an object, of every *kernels.py of the package, of the tuples that they take and how they are
    compiled."""
    digest = hashlib.sha256()
    for source in (
        *(HERE / "compiled" / name for name in ("jit.py", "pass_by_reference.py")),
        *sorted(HERE.rglob("*kernels.py")),
        *(HERE / name for name in TUPLES),
    ):
        digest.update(str(source.relative_to(HERE)).encode() + b"\0" + source.read_bytes())
    return digest


def kernel_key() -> str:
    """Hash of the kernels and their compilers, the kind of CPU and what it can do."""
    digest = sources()
    checked = os.environ.get("NUMBA_BOUNDSCHECK", "")
    made_by = (
        f"{package_version('numba')} {package_version('llvmlite')} {sys.version_info[:2]} {checked}"
    )
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
    """The user's cache folder for this state of the kernels; where it is not the user's own or cannot be written, that
    of the session (XDG_RUNTIME_DIR), else one of this process alone."""
    return _place()[0]


def why_elsewhere() -> str:
    """Why `cache_folder` is not among the user's caches, "" where it is."""
    return _place()[1]


@cache
def _placed() -> tuple[Path, str]:
    """The folder of this process, and why it is not the user's."""
    return _place()


def _place() -> tuple[Path, str]:
    session, name = os.environ.get("XDG_RUNTIME_DIR"), Path("patchfem") / kernel_key()
    first = user_cache.prepare_folder(user_cache.cache_base() / name)
    if not first:
        return user_cache.cache_base() / name, ""
    if session and not user_cache.prepare_folder(Path(session) / name):
        return Path(session) / name, first
    user_cache.prepare_folder(user_cache.process_folder() / name)  # makes it where it can
    return user_cache.process_folder() / name, first


class Kernels:
    """A module of compiled code that is imported when it is needed.

    `__name__` is that of the module. An attribute is a function to call, a constant that stands in its text, or, with
    the module imported, anything else of it.
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
        """The module itself."""
        _prepared()
        return self._bring()


SPENT = [0.0]  # seconds in which this process made code, or waited for one that did


@contextmanager
def spending():
    """What is done within counts among the seconds of `SPENT`."""
    begin = monotonic()
    try:
        yield
    finally:
        SPENT[0] += monotonic() - begin


@contextmanager
def tidied_later():
    """No search for cyclic garbage within: a seventh of the time of a compilation, which makes millions of objects."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


@contextmanager
def alone(path: Path):
    """One process at a time within, by a lock on a file, which the system takes from a process that is killed.

    Others wait, `WAIT` at most: on a network's file system the lock of a machine that is gone may stay. Where a file
    system has no locks nobody waits.
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
    """A function of a module of compiled code: its kept machine code where there is some, else by numba, or as Python
    while that costs little."""

    def __init__(self, home: Kernels, name: str, kept: str):
        self.home, self.name, self.kept = home, name, kept
        self.words, self.codes, self.as_python = machine.Words(), {}, inf

    def expect(self, seconds: float) -> None:
        """Take note of calls that are to come and what they would take as Python [CPU s], an estimate that is the same
        in every process: so is what runs as Python."""
        self.as_python = seconds + (self.as_python if self.as_python < inf else 0.0)

    def is_kept(self, *arguments) -> bool:
        """Return whether machine code is kept for arguments of these types."""
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
        """What the function returns at its first call with arguments of these kinds, for which its code is brought."""
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
        """Machine code made for arguments of these types, or by another process meanwhile; None where there is none."""
        with alone(path.with_suffix(".lock")):
            code = machine.found(path)
            if code is None:
                _tell()
                with tidied_later():
                    optimised = import_module(f"{__name__}.jit").optimised  # brings numba
                    code = machine.make(path, self.function(), arguments, optimised)
        return code

    def function(self):
        """The function of the module, which numba compiles or finds in its cache."""
        function = getattr(self.home.module(), self.name)
        return function.alone() if hasattr(function, "alone") else function

    def __getattr__(self, name: str):
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.function(), name)


@cache
def _names(text: Path | str) -> tuple:
    """What a module names, read from its text or its file: its constants, numbers and texts, and its compiled
    functions."""
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
    """What an expression stands for: constants and these names with arithmetic between them, ranges of them; KeyError
    for others."""
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
    """A module of the package, such as "dynamics.modal_kernels", its compiled code cached on disk; `say` is told when
    nothing is there yet and it has to compile first. Modules named *kernels come as `Kernels`."""
    _prepared(say)
    return kernels(module) if module.endswith("kernels") else import_module(f"patchfem.{module}")


@cache
def kernels(module: str) -> Kernels:
    """The module of compiled code of this name, nothing of it loaded."""
    name = f"patchfem.{module}"
    return Kernels(
        name, HERE.joinpath(*module.split(".")).with_suffix(".py"), lambda: import_module(name)
    )


def instance(module: str, parts: dict, say=None):
    """A module of compiled code with others in place of modules that it imports, as `Kernels`.

    module: as of `load`; parts: name under which the module imports another (`from . import other as name`) -> the
    module, or its name as of `load`, that takes its place and must offer the same functions. The text differs from the
    file in these lines alone, so its lines have the numbers of the file in every traceback. It is kept in the folder of
    the compiled code, under a name with the hash of its content, and written in one move: processes may ask for it at
    once, and the package may be read-only. ValueError where the module has no such part.
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
    """Short hash of a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def written(module: str, text: str, say=None, parts=()):
    """The module of compiled code, named as of `load`, whose text is kept in the folder of the compiled code.

    parts: Kernels that the text imports, brought before it.
    """
    name = f"patchfem.{module}"
    path, data = _prepared(say) / "instances" / f"{module}.py", text.encode()
    kept = _bytes_of(path) == data or user_cache.write_file(path, data)

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
    """Note that a run of this kind came to its end: its compiled code is kept."""
    if not PLAIN:
        user_cache.write_file(_folder() / "kinds" / digest(kind), kind.encode())


def has_run(kind: str) -> bool:
    """Whether a run of this kind has come to its end with the kernels as they are, so that nothing of it compiles."""
    return PLAIN or any((one / "kinds" / digest(kind)).is_file() for one in _kept())


def _kept(own_code: Path | None = None) -> list:
    """Folders in which compiled code may be: that of this machine, and what came with the package."""
    return [own_code or _placed()[0], *filter(None, [prebuilt.folder(sources)])]


def _generic(path: Path) -> machine.Code | None:
    """The code that came with the package for a file of this name."""
    found = prebuilt.folder(sources)
    return found and machine.found(found / "code" / path.name)


def _bytes_of(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except OSError:
        return None


def _prepared(say=None) -> Path:
    """The folder of the compiled code, made known to numba; `say` is told, once, where nothing is in it."""
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
    """Tell `say` what `load` tells it, but where something is compiled and not before."""
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
        why = _placed()[1] or space_shortage(_folder() / "code", LEAST)
        say(
            "compiling the code of the simulation for this machine, "
            + (
                f"which takes 10 to 30 s at every command because the compiled code cannot be kept: {why}; set "
                "PATCHFEM_CACHE to another folder"
                if why
                else "which takes 10 to 30 s and is needed only once"
            )
        )
