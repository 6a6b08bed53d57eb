"""Files of machine code that run without importing numba.

Numba takes half a second before it can load a function from its cache, because it imports its whole compiler. So the
machine code of a function is stored a second time, together with an entry function that reads the arguments from a
buffer of 8-byte words (status, results, then arguments as numba flattens them). `found` loads this file by llvmlite.

This is possible for functions of floats, integers, arrays and tuples of these that call only the C library. For other
functions `keep` writes nothing, and numba loads them from its cache. A file consists of one line of JSON and an object
file.
"""

import ctypes
import hashlib
import json
import os
import struct
import threading
from functools import cache
from pathlib import Path

import numpy as np

from ..disk import user_cache

FINE = (0, -2)  # status codes of numba for success: the function returned a value, or None
NUMBERS = {float: "d", int: "q", np.float64: "d", np.int64: "q"}
_KINDS = {}  # (dtype, dimensions, flags) of an array -> (type code, packer of words, is C-contiguous and writeable)
PARTS = 12  # number of tuples whose words are cached, because a run passes the same tuples in many calls


class Unfit(Exception):
    """Function or argument that this module does not support."""


class Words:
    """Conversion of arguments to words, with a cache of tuples, whose fields never change."""

    def __init__(self):
        self.known, self.lock = {}, threading.Lock()

    def of(self, value) -> tuple:
        """Return the type code and the words (bytes) of an argument; raise Unfit for other types.

        A tuple that contains only numbers is not cached.
        """
        kind = NUMBERS.get(type(value))
        if kind is not None:
            return kind, struct.pack(kind, value)
        if isinstance(value, np.ndarray):
            return _of_array(value)
        if not isinstance(value, tuple):
            raise Unfit
        held = self.known.get(id(value))
        if held is None:
            kinds, words = zip(*(self.of(one) for one in value)) if value else ((), ())
            held = value, f"{type(value).__name__}({','.join(kinds)})", b"".join(words)
            # a tuple of numbers is made for a single call and would displace others from the cache
            if all(map(NUMBERS.__contains__, map(type, value))):
                return held[1:]
            with self.lock:
                self.known[id(value)] = held
                while len(self.known) > PARTS:
                    del self.known[next(iter(self.known))]
        return held[1:]


def _of_array(value) -> tuple:
    flags, count = value.flags, value.ndim
    held = _KINDS.get((value.dtype, count, flags.num))
    if held is None:
        order = "C" if flags.c_contiguous else "F" if flags.f_contiguous else "A"
        kind = f"{value.dtype.str}{count}{order}{'' if flags.writeable else 'r'}{'' if flags.aligned else 'u'}"
        held = kind, struct.Struct(f"{5 + 2 * count}q").pack, order == "C" and flags.writeable
        _KINDS[value.dtype, count, flags.num] = held
    kind, pack, plain = held
    # `__array_interface__` takes 3 us, which matters in a short call
    there = (
        ctypes.addressof(ctypes.c_char.from_buffer(value))
        if plain and value.size
        else value.__array_interface__["data"][0]
    )
    return kind, pack(0, 0, value.size, value.itemsize, there, *value.shape, *value.strides)


class Code:
    """Loaded machine code of a function; a call takes the words of its arguments as bytes."""

    def __init__(self, address: int, results, nogil: bool = False):
        # CFUNCTYPE releases the global interpreter lock during the call, PYFUNCTYPE keeps it
        kind = ctypes.CFUNCTYPE if nogil else ctypes.PYFUNCTYPE
        self.call = kind(None, ctypes.c_void_p)(address)
        self.results, self.leaves = results, _leaves(results)
        self.front = bytes(8 * (1 + max(len(self.leaves), 1)))

    def __call__(self, words: bytes):
        """Call the function and return its result; raise RuntimeError if it raised an exception."""
        row = bytearray(self.front + words)
        self.call(ctypes.addressof(ctypes.c_char.from_buffer(row)))
        status = struct.unpack_from("q", row)[0]
        if status not in FINE:
            raise RuntimeError(f"compiled code ended with status {status}")
        return _shaped(self.results, iter(struct.unpack_from(self.leaves, row, 8)))


def _leaves(results) -> str:
    return results if isinstance(results, str) else "".join(map(_leaves, results))


def _shaped(results, values):
    if results == "":
        return None
    return (
        next(values) if isinstance(results, str) else tuple(_shaped(one, values) for one in results)
    )


def found(path: Path) -> Code | None:
    """Load the function of a file; return None if there is no usable file.

    The file may be missing or damaged, or contain code that this machine cannot run.
    """
    try:
        return loaded(path.read_bytes())
    except OSError:
        return None


def loaded(content: bytes) -> Code | None:
    """Load a function from the content of its file; return None if this machine cannot use it."""
    try:
        line, _, code = content.partition(b"\n")
        about = json.loads(line)
        whole = about["sha256"] == hashlib.sha256(code).hexdigest()
        if not (whole and os.name == "posix" and all(map(_in_c_library, about["calls"]))):
            return None
        engine, binding = _engine()
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()
        return Code(
            engine.get_function_address(about["name"]), about["results"], about.get("nogil", False)
        )
    except (ValueError, KeyError, ImportError, RuntimeError):
        return None


@cache
def _engine() -> tuple:
    """Return the engine that owns loaded code and the binding module of llvmlite.

    Both are kept until the process ends, because loaded functions need them.
    """
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    machine = binding.Target.from_default_triple().create_target_machine()
    return binding.create_mcjit_compiler(binding.parse_assembly(""), machine), binding


def _in_c_library(name: str) -> bool:
    """Return whether a function is in the C library and does not belong to Python or numba.

    Functions of Python and numba need more than a call: the interpreter or the run-time library of numba.
    """
    return not name.lstrip("_").startswith(("Py", "NRT", "numba")) and hasattr(_process(), name)


@cache
def _process():
    try:
        return ctypes.CDLL(None)
    except (OSError, TypeError):
        return object()


def keep(path: Path, function, arguments: tuple) -> bool:
    """Write the machine code of a compiled function to a file; return False on failure.

    Parameters
    ----------
    path : Path
    function : numba dispatcher
        Function that has been called with these arguments.
    arguments : tuple
        Arguments whose types select the compiled version.

    Returns
    -------
    bool
        False if the file cannot be written or the code needs numba to run.
    """
    try:
        made = function.overloads[tuple(map(function.typeof_pyval, arguments))]
        return user_cache.write_cache_file(
            path, _content(path.name, function.targetctx, made, function.targetoptions)
        )
    except Exception:  # numba and llvmlite may raise any; the run already has its function
        return False


def make(path: Path, function, arguments: tuple, optimised) -> Code | None:
    """Compile a function for such a file, write the file if possible, and load the code.

    Parameters
    ----------
    path : Path
    function : numba dispatcher
    arguments : tuple
        Arguments whose types select the version to compile.
    optimised : callable
        `jit.optimised`; a parameter because importing `jit` imports numba.

    Returns
    -------
    Code or None
        None if the function cannot be compiled in this way.
    """
    if os.name != "posix":
        return None
    try:
        content = _content(path.name, *optimised(function, arguments), function.targetoptions)
    except Exception:  # numba reports an error of the function at the call
        return None
    user_cache.write_cache_file(path, content)
    return loaded(content)


def _content(name: str, target, made, options: dict) -> bytes:
    """Return the content of the file of this name for a function that numba compiled.

    Parameters
    ----------
    name : str
        File name, from which the name of the entry function is made.
    target : numba target context
    made : numba CompileResult
    options : dict
        Options of the function.

    Raises
    ------
    Unfit
        If the function calls others than those of the C library.
    """
    name = "patchfem_" + hashlib.sha256(name.encode()).hexdigest()[:16]
    results = _results(made.signature.return_type)
    code, calls = _code(target, made, name, max(len(_leaves(results)), 1))
    if not all(map(_in_c_library, calls)):
        raise Unfit
    about = {
        "name": name,
        "results": results,
        "calls": calls,
        "sha256": hashlib.sha256(code).hexdigest(),
        "nogil": bool(options.get("nogil")),
    }
    return json.dumps(about).encode() + b"\n" + code


def _results(kind, inside: bool = False):
    """Return the format of the result of a function; raise Unfit for other types.

    It is "d" for a float, "q" for an integer, "" for None, "?" for a boolean, and a list of formats for a tuple.
    """
    from numba.core import types

    if kind == types.boolean and not inside:
        return "?"
    if isinstance(kind, types.NoneType):
        return ""
    if isinstance(kind, types.BaseTuple):
        return [_results(one, True) for one in kind]
    if kind == types.float64 or (
        isinstance(kind, types.Integer) and kind.bitwidth == 64 and kind.signed
    ):
        return "d" if kind == types.float64 else "q"
    raise Unfit


def _code(target, made, name: str, results: int) -> tuple:
    """Emit the object code of a function with an entry function, and list its external calls.

    Parameters
    ----------
    target : numba target context
    made : numba CompileResult
    name : str
        Name of the entry function.
    results : int
        Number of words of the results.

    Returns
    -------
    code : bytes
        Object file.
    calls : list of str
        Names of the external functions and variables that the code needs.
    """
    from llvmlite import binding, ir

    from .pass_by_reference import Held, words

    whole = made.library._get_module_for_linking().clone()
    inner, word = (
        target.call_conv.get_function_type(made.signature.return_type, made.signature.args),
        ir.IntType(64),
    )
    module = ir.Module()
    module.triple, module.data_layout = whole.triple, whole.data_layout
    called = ir.Function(module, inner, made.fndesc.llvm_func_name)
    entry = ir.Function(module, ir.FunctionType(ir.VoidType(), [word.as_pointer()]), name)
    build = ir.IRBuilder(entry.append_basic_block())
    row, given, at, flat = entry.args[0], [], 1 + results, iter(inner.args[2:])
    for taken in made.signature.args:
        count = words(taken)
        if isinstance(taken, Held):
            given.append(build.bitcast(build.gep(row, [word(at)]), next(flat)))
        else:
            for k in range(count):
                kind = next(flat)
                if not isinstance(kind, (ir.PointerType, ir.DoubleType)) and kind != word:
                    raise Unfit
                given.append(
                    build.load(build.bitcast(build.gep(row, [word(at + k)]), kind.as_pointer()))
                )
        at += count
    answer = build.bitcast(build.gep(row, [word(1)]), inner.args[0])
    fault = build.bitcast(build.alloca(ir.IntType(8).as_pointer()), inner.args[1])
    build.store(build.sext(build.call(called, [answer, fault, *given]), word), row)
    build.ret_void()

    whole.link_in(binding.parse_assembly(str(module)))
    for part in (*whole.functions, *whole.global_variables):
        if not part.is_declaration and part.name != name:
            part.linkage = "internal"
    machine = target.codegen()._tm
    passes = binding.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()  # removes the wrapper for Python
    passes.run(
        whole, binding.create_pass_builder(machine, binding.create_pipeline_tuning_options())
    )
    calls = [
        part.name
        for part in (*whole.functions, *whole.global_variables)
        if part.is_declaration and not part.name.startswith("llvm.")
    ]
    return machine.emit_object(whole), calls
