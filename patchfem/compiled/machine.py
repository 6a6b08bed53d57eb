"""Machine code of compiled functions in files of its own, which run without numba.

Numba needs half a second before it can load a function from its cache: it brings up a compiler, though nothing is left
to compile. So the machine code of a function is kept once more, with one function around it that takes the arguments
from a row of 8-byte words (status, results, then arguments as numba flattens them), and `found` loads it by llvmlite.

It serves functions of floats, whole numbers, arrays and tuples of these that call nothing but the C library; for any
other `keep` writes nothing and numba goes on to load it. A file is one line of JSON, then an object file.
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

FINE = (0, -2)  # numba's status of a function that returned something, or nothing
NUMBERS = {float: "d", int: "q", np.float64: "d", np.int64: "q"}
_KINDS = {}  # (dtype, dimensions, flags) of an array -> its kind, what packs its words, whether it lends its memory
PARTS = 12  # tuples of arguments whose words are remembered: a run calls with the same ones again and again


class Unfit(Exception):
    """An argument that is no number, array or tuple of these."""


class Words:
    """Arguments as words; tuples are remembered, for their fields never change."""

    def __init__(self):
        self.known, self.lock = {}, threading.Lock()

    def of(self, value) -> tuple:
        """(kind, bytes) of an argument: its type in short, its words. Unfit where it has none.

        A tuple of numbers alone is not remembered.
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
            # made for one call: it would push others out
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
    # numpy describes an array at length for its interface: 3 us, which a short call would feel
    there = (
        ctypes.addressof(ctypes.c_char.from_buffer(value))
        if plain and value.size
        else value.__array_interface__["data"][0]
    )
    return kind, pack(0, 0, value.size, value.itemsize, there, *value.shape, *value.strides)


class Code:
    """A function of machine code: called with the words of its arguments."""

    def __init__(self, address: int, results, nogil: bool = False):
        # the first lets other threads of Python run
        kind = ctypes.CFUNCTYPE if nogil else ctypes.PYFUNCTYPE
        self.call = kind(None, ctypes.c_void_p)(address)
        self.results, self.leaves = results, _leaves(results)
        self.front = bytes(8 * (1 + max(len(self.leaves), 1)))

    def __call__(self, words: bytes):
        """What the function returns; RuntimeError where it raised."""
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
    """The function of a file; None where there is no file, or one that is damaged or that this machine cannot run."""
    try:
        return loaded(path.read_bytes())
    except OSError:
        return None


def loaded(content: bytes) -> Code | None:
    """The function of the content of a file; None as of `found`."""
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
    """What holds loaded code, and llvmlite's binding; both live as long as the process."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    machine = binding.Target.from_default_triple().create_target_machine()
    return binding.create_mcjit_compiler(binding.parse_assembly(""), machine), binding


def _in_c_library(name: str) -> bool:
    """Whether a name is one of the process itself, and not of Python or of numba, which need more than a call."""
    return not name.lstrip("_").startswith(("Py", "NRT", "numba")) and hasattr(_process(), name)


@cache
def _process():
    try:
        return ctypes.CDLL(None)
    except (OSError, TypeError):
        return object()


def keep(path: Path, function, arguments: tuple) -> bool:
    """Write the code of a compiled function for arguments of these types; False where it is of no use without numba.

    function: a numba dispatcher that has been called with them.
    """
    try:
        made = function.overloads[tuple(map(function.typeof_pyval, arguments))]
        return user_cache.write_cache_file(
            path, _content(path.name, function.targetctx, made, function.targetoptions)
        )
    except (
        Exception
    ):  # of numba's and llvmlite's insides: whatever they refuse, the run has its function already
        return False


def make(path: Path, function, arguments: tuple, optimised) -> Code | None:
    """The code of a function, which numba makes for this alone, also written where there is room; None where it is not
    to be had so.

    function: a numba dispatcher; optimised: that of the module `inner`.
    """
    if os.name != "posix":
        return None
    try:
        content = _content(path.name, *optimised(function, arguments), function.targetoptions)
    except Exception:  # of their insides: what they refuse is told by the call itself
        return None
    user_cache.write_cache_file(path, content)
    return loaded(content)


def _content(name: str, target, made, options: dict) -> bytes:
    """Content of the file of this name: numba's result of a compilation for a target. Unfit where it calls more than
    the C library."""
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
    """Results of a function as "d", "q", "" or a list of these, "?" of one that answers yes or no; Unfit for others."""
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
    """Object code of a compiled function behind `name`, and the functions that it calls elsewhere.

    made: numba's result of the compilation; results: words that they take.
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
    passes.add_global_dead_code_eliminate_pass()  # what wraps the function for Python
    passes.run(
        whole, binding.create_pass_builder(machine, binding.create_pipeline_tuning_options())
    )
    calls = [
        part.name
        for part in (*whole.functions, *whole.global_variables)
        if part.is_declaration and not part.name.startswith("llvm.")
    ]
    return machine.emit_object(whole), calls
