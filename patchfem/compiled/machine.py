"""Files of machine code that run without importing numba.

Numba takes half a second before it can load a function from its cache, because it imports its whole compiler. So the
machine code of a function is stored a second time, together with an entry function that reads the arguments from a
buffer of 8-byte words (status, results, then arguments as numba flattens them). `load_file` loads this file by llvmlite.

This is possible for functions of floats, integers, arrays and tuples of these that call only the C library; numba runs
others and loads them from its cache. A file consists of one line of JSON and an object file.

A function is compiled in two steps. The first one makes LLVM code that names no CPU: numba translates the function and all
that it calls, and LLVM optimises them together with the entry function. The second one, without numba, adds the vector
instructions of this CPU where the function asks for them and emits the object file.
"""

import ctypes
import hashlib
import json
import os
import re
import struct
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np

from ..disk import user_cache

# Status codes of a function that returned a value, and of one that returned None
NUMBA_SUCCESS_CODES = (0, -2)
# Type code of `struct` for each type of number that a function takes.
STRUCT_TYPE_CODES = {float: "d", int: "q", np.float64: "d", np.int64: "q"}
_ARRAY_FORMATS = {}  # `ArrayFormat` for each (dtype, number of dimensions, flags) of an array
# Portable code of the functions that numba compiled in this process, by the names of their files.
PORTABLE_CODES: dict[str, bytes] = {}
# Number of tuples whose words are cached. A run passes the same few in many calls, of several functions in turn.
MAX_CACHED_TUPLES = 12


class UnsupportedError(Exception):
    """Function or argument that this module does not support."""


class ArgumentConverter:
    """Converter of call arguments to machine words, with a cache for tuples, which are immutable."""

    def __init__(self):
        self.known_tuples = {}
        self.lock = threading.Lock()

    def convert(self, value) -> tuple[str, bytes]:
        """Return the type code and the machine words (bytes) of an argument `value`.

        Raises UnsupportedError for a type that compiled code cannot take. A tuple that contains only numbers is not
        cached.
        """
        code = STRUCT_TYPE_CODES.get(type(value))
        if code is not None:
            return code, struct.pack(code, value)
        if isinstance(value, np.ndarray):
            return _convert_array(value)
        if not isinstance(value, tuple):
            raise UnsupportedError

        # A tuple of numbers is made for a single call and would displace others from the cache.
        codes = [STRUCT_TYPE_CODES.get(type(element)) for element in value]
        if None not in codes:
            return _name_tuple(value, codes), struct.pack("".join(codes), *value)

        # A cached tuple stands as (tuple, type code, words) at its `id`. The one used last is at the end.
        with self.lock:
            known = self.known_tuples.pop(id(value), None)
            if known is not None:
                self.known_tuples[id(value)] = known
        if known is None:
            codes, words = zip(*map(self.convert, value))
            # The tuple itself is cached too, so that no other object gets its `id`.
            known = value, _name_tuple(value, codes), b"".join(words)
            with self.lock:
                self.known_tuples[id(value)] = known
                while len(self.known_tuples) > MAX_CACHED_TUPLES:
                    del self.known_tuples[next(iter(self.known_tuples))]
        return known[1:]


def _name_tuple(value, codes) -> str:
    """Return the type code of a tuple whose elements have given type codes."""
    return f"{type(value).__name__}({','.join(codes)})"


class ArrayFormat(NamedTuple):
    """Format in which arrays of one type are converted to machine words.

    - type_code: dtype, number of dimensions, memory order, and "r" for read-only or "u" for unaligned arrays
    - pack: function that packs the words
    - is_buffer: whether the array is C-contiguous and writeable, so `ctypes` can take its address
    """

    type_code: str
    pack: Callable[..., bytes]
    is_buffer: bool


def _convert_array(array) -> tuple[str, bytes]:
    """Return the type code and the machine words (bytes) of an array."""
    key = array.dtype, array.ndim, array.flags.num
    known = _ARRAY_FORMATS.get(key)
    if known is None:
        known = _ARRAY_FORMATS[key] = _make_array_format(array)
    # `__array_interface__` takes 3 us, which matters in a short call.
    if known.is_buffer and array.size:
        address = ctypes.addressof(ctypes.c_char.from_buffer(array))
    else:
        address = array.__array_interface__["data"][0]
    words = known.pack(0, 0, array.size, array.itemsize, address, *array.shape, *array.strides)
    return known.type_code, words


def _make_array_format(array) -> ArrayFormat:
    """Return type code and packing of arrays with the type, dimensions and layout of this array."""
    flags = array.flags
    order = "A"
    if flags.c_contiguous:
        order = "C"
    elif flags.f_contiguous:
        order = "F"
    restrictions = ("" if flags.writeable else "r") + ("" if flags.aligned else "u")
    type_code = f"{array.dtype.str}{array.ndim}{order}{restrictions}"
    pack = struct.Struct(f"{5 + 2 * array.ndim}q").pack
    return ArrayFormat(type_code, pack, order == "C" and flags.writeable)


class LoadedFunction:
    """Loaded machine code of a function; a call takes its arguments as machine words in bytes.

    Parameters
    ----------
    address : int
        Address of the machine code in memory.
    result_format : str or list
        Format of the result (`_describe_result`).
    nogil : bool
        Whether the function releases the global interpreter lock.
    """

    def __init__(self, address: int, result_format, *, nogil: bool = False):
        # CFUNCTYPE releases the global interpreter lock during the call, PYFUNCTYPE keeps it.
        prototype = ctypes.CFUNCTYPE if nogil else ctypes.PYFUNCTYPE
        self.call = prototype(None, ctypes.c_void_p)(address)
        self.result_format = result_format
        self.flat_format = _flatten_format(result_format)
        # Words of the status and of the results, which precede the arguments.
        self.header = bytes(8 * (1 + max(len(self.flat_format), 1)))

    def __call__(self, words: bytes):
        """Call the function and return its result.

        RuntimeError is raised if the function raised an exception. `words` are the machine words of all arguments.
        """
        buffer = bytearray(self.header + words)
        self.call(ctypes.addressof(ctypes.c_char.from_buffer(buffer)))
        status = struct.unpack_from("q", buffer)[0]
        if status not in NUMBA_SUCCESS_CODES:
            raise RuntimeError(f"compiled code ended with status {status}")
        values = struct.unpack_from(self.flat_format, buffer, 8)
        return _build_result(self.result_format, iter(values))


def _flatten_format(result_format) -> str:
    """Return the characters, as in `struct`, of all numbers of a result in their order in memory.

    `result_format` is the character of a number, or a list of the formats of the elements of a tuple.
    """
    if isinstance(result_format, str):
        return result_format
    return "".join(map(_flatten_format, result_format))


def _build_result(result_format, values):
    """Return a result of this format from an iterator over its numbers, `values`.

    `result_format` is the character of a number, a list of the formats of the elements of a tuple, or "" for None.
    """
    if result_format == "":
        return None
    if isinstance(result_format, str):
        return next(values)
    return tuple(_build_result(element, values) for element in result_format)


def load_file(path: Path) -> LoadedFunction | None:
    """Load the function in the file `path`, or return None if there is no usable file.

    The file may be missing or damaged, or contain code that this machine cannot run.
    """
    try:
        return load_code(path.read_bytes())
    except OSError:
        return None


def load_code(content: bytes) -> LoadedFunction | None:
    """Load a function from the content of its file; return None if this machine cannot use it."""
    try:
        header, code = split_file(content)
        if not (os.name == "posix" and all(map(_is_in_c_library, header["calls"]))):
            return None
        engine = _create_engine()
        engine.add_object_file(_import_binding().ObjectFileRef.from_data(code))
        engine.finalize_object()
        address = engine.get_function_address(header["name"])
        return LoadedFunction(address, header["results"], nogil=header["nogil"])
    except (ValueError, KeyError, ImportError, RuntimeError):
        return None


@cache
def _import_binding() -> ModuleType:
    """Return the binding module of llvmlite, which is ready to compile for this kind of CPU."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    return binding


@cache
def _create_engine():
    """Return the engine that owns loaded code.

    It is kept until the process ends, because loaded functions need it.
    """
    binding = _import_binding()
    machine = binding.Target.from_default_triple().create_target_machine()
    return binding.create_mcjit_compiler(binding.parse_assembly(""), machine)


def _is_in_c_library(name: str) -> bool:
    """Return whether the function `name` is in the C library and does not belong to Python or numba.

    Functions of Python and numba need more than a call: the interpreter or the run-time library of numba.
    """
    return not name.lstrip("_").startswith(("Py", "NRT", "numba")) and hasattr(
        _load_c_library(), name
    )


@cache
def _load_c_library():
    """Return the symbols of this process, which include those of the C library; none on Windows."""
    try:
        return ctypes.CDLL(None)
    except (OSError, TypeError):
        return object()


def compile_function(
    path: Path, function, arguments: tuple[object, ...], compiler, *, is_vectorised: bool = True
) -> LoadedFunction | None:
    """Compile a function by numba, write its file of machine code if possible, and load the code.

    Parameters
    ----------
    path : Path
        File of the machine code.
    function : numba dispatcher
        Function before its compilation.
    arguments : tuple
        Arguments whose types select the version to compile.
    compiler : callable
        `jit.compile_unoptimised`; a parameter because importing `jit` imports numba.
    is_vectorised : bool
        Whether LLVM looks for loops that it can turn into vector instructions.

    Returns
    -------
    LoadedFunction or None
        None if the function cannot be compiled in this way.
    """
    if os.name != "posix":
        return None
    try:
        target, result = compiler(function, arguments)
        header = {
            "name": "patchfem_" + hashlib.sha256(path.name.encode()).hexdigest()[:16],
            "results": _describe_result(result.signature.return_type),
            "nogil": bool(function.targetoptions.get("nogil")),
            "is_vectorised": is_vectorised,
        }
        text = _write_portable_code(target, result, header)
    except Exception:  # numba reports an error of the function at the call
        return None
    PORTABLE_CODES[path.name] = join_file(header, text.encode())
    return compile_for_this_cpu(path, PORTABLE_CODES[path.name])


def compile_for_this_cpu(path: Path, portable: bytes) -> LoadedFunction | None:
    """Compile portable code by LLVM alone, write the file of machine code if possible, and load the code.

    Parameters
    ----------
    path : Path
        File of the machine code.
    portable : bytes
        LLVM code that names no CPU, with its header.

    Returns
    -------
    LoadedFunction or None
        None if the portable code is damaged, or if this version of LLVM cannot read it.
    """
    try:
        header, text = split_file(portable)
        binding = _import_binding()
        target_machine = create_target_machine(*_find_cpu(binding))
        module = binding.parse_assembly(text.decode())
        module.triple = target_machine.triple
        module.data_layout = str(target_machine.target_data)
        module.verify()
    except (ValueError, KeyError, ImportError, RuntimeError):
        return None

    # The code is optimised already, but without the vector instructions of a CPU.
    if header["is_vectorised"]:
        builder = create_pass_builder(target_machine, level=3, is_vectorised=True)
        builder.getModulePassManager().run(module, builder)

    # What is declared but not defined here must be found in the C library when the code is loaded.
    symbols = (*module.functions, *module.global_variables)
    declared = [symbol.name for symbol in symbols if symbol.is_declaration]
    header["calls"] = [name for name in declared if not name.startswith("llvm.")]
    if not all(map(_is_in_c_library, header["calls"])):
        return None
    content = join_file(header, target_machine.emit_object(module))
    user_cache.write_cache_file(path, content)
    return load_code(content)


def join_file(header: dict[str, object], code: bytes) -> bytes:
    """Return the content of a file: a line of JSON with the hash of the code, and the code."""
    header = header | {"sha256": hashlib.sha256(code).hexdigest()}
    return json.dumps(header).encode() + b"\n" + code


def split_file(content: bytes) -> tuple[dict[str, object], bytes]:
    """Return the header and the code in the content of a file.

    ValueError is raised if the file is damaged.
    """
    line, _, code = content.partition(b"\n")
    header = json.loads(line)
    if not isinstance(header, dict) or header.get("sha256") != hashlib.sha256(code).hexdigest():
        raise ValueError("the checksum does not match")
    return header, code


def _describe_result(kind):
    """Return the format of a result of the numba type `kind`.

    Raises UnsupportedError for types that compiled code cannot return. The format is "d" for a float, "q" for an
    integer, "" for None, "?" for a boolean, and a list of formats for a tuple.
    """
    from numba.core import types

    if kind == types.boolean:
        return "?"
    if isinstance(kind, types.NoneType):
        return ""
    if isinstance(kind, types.BaseTuple):
        # A boolean in a tuple takes one byte, not a word of eight.
        if types.boolean in kind.types:
            raise UnsupportedError
        return [_describe_result(element) for element in kind]
    if kind == types.float64:
        return "d"
    if isinstance(kind, types.Integer) and kind.bitwidth == 64 and kind.signed:
        return "q"
    raise UnsupportedError


def _write_portable_code(target, result, header: dict[str, object]) -> str:
    """Return the optimised LLVM code of a function with an entry function, which names no CPU.

    Parameters
    ----------
    target : numba target context
        Context with the calling convention and the code generator.
    result : numba CompileResult
        The compiled function.
    header : dict
        Header of its file, with the name of the entry function and the format of the results.
    """
    from llvmlite import binding

    linked = result.library._get_module_for_linking().clone()
    n_result_words = max(len(_flatten_format(header["results"])), 1)
    entry_text = _write_entry_function(target, result, header["name"], n_result_words, linked)
    linked.link_in(binding.parse_assembly(entry_text))

    # Only the entry function is visible from outside, so that LLVM may change how the others are called and remove what
    # it does not call: the engine is 1.5 times faster than with symbols that become internal after the optimisation. Names
    # of numba depend on the process.
    for number, symbol in enumerate((*linked.functions, *linked.global_variables)):
        if not symbol.is_declaration and symbol.name != header["name"]:
            symbol.name = f"symbol_{number}"
            symbol.linkage = "internal"

    # Levels 2 and 3 give engines of the same speed, and vector instructions belong to a CPU.
    builder = create_pass_builder(create_target_machine(), level=1)
    builder.getModulePassManager().run(linked, builder)
    passes = binding.create_new_module_pass_manager()
    passes.add_strip_symbols_pass()
    passes.run(linked, builder)
    # Functions that numba has optimised itself have their names in the metadata of aliases.
    text = re.sub(r'!"_ZN[^"]*"', '!"numba"', str(linked))
    described = ("; ModuleID", "source_filename", "target ")
    lines = text.splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith(described))


@cache
def create_target_machine(cpu: str = "", features: str = ""):
    """Return the machine of LLVM for a CPU with instruction sets `features`; by default for any CPU of this kind."""
    target = _import_binding().Target.from_default_triple()
    return target.create_target_machine(
        cpu=cpu, features=features, reloc="static", codemodel="jitdefault", jit=True
    )


def _find_cpu(binding) -> tuple[str, str]:
    """Return the name of this CPU and its instruction sets; "" if LLVM does not know them."""
    try:
        return binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    except RuntimeError:
        return "", ""


def create_pass_builder(target_machine, *, level: int = 1, is_vectorised: bool = False):
    """Return the builder of the optimisation passes of LLVM.

    Parameters
    ----------
    target_machine
        Machine of LLVM for which the passes optimise.
    level : int
        Optimisation level, 1 to 3.
    is_vectorised : bool
        Whether loops may become vector instructions.
    """
    options = _import_binding().create_pipeline_tuning_options(speed_level=level)
    options.loop_vectorization = options.slp_vectorization = is_vectorised
    return _import_binding().create_pass_builder(target_machine, options)


def _write_entry_function(target, result, name: str, n_result_words: int, linked) -> str:
    """Return the LLVM code of the function that reads the arguments from the buffer of words.

    Parameters
    ----------
    target : numba target context
        Context with the calling convention.
    result : numba CompileResult
        The compiled function.
    name : str
        Name of the entry function.
    n_result_words : int
        Number of words of the results, which follow the first word of the buffer.
    linked : llvmlite module
        Module with the code of the function, whose triple and data layout the entry function gets.

    Raises
    ------
    UnsupportedError
        If an argument is neither a pointer, a float nor a 64-bit integer.
    """
    from llvmlite import ir

    from .pass_by_reference import ReferencedTuple, count_words

    # A module of its own declares the function, and defines the entry function that calls it.
    signature = result.signature
    function_type = target.call_conv.get_function_type(signature.return_type, signature.args)
    word = ir.IntType(64)
    module = ir.Module()
    module.triple = linked.triple
    module.data_layout = linked.data_layout
    function = ir.Function(module, function_type, result.fndesc.llvm_func_name)
    entry = ir.Function(module, ir.FunctionType(ir.VoidType(), [word.as_pointer()]), name)
    builder = ir.IRBuilder(entry.append_basic_block())

    # The arguments stand in the buffer behind the result.
    buffer = entry.args[0]
    arguments = []
    offset = 1 + n_result_words
    # The first two arguments of a function compiled by numba are the addresses of
    # the result and of the exception.
    result_type, exception_type, *llvm_types = function_type.args
    remaining_types = iter(llvm_types)
    for argument_type in signature.args:
        n_words = count_words(argument_type)
        if isinstance(argument_type, ReferencedTuple):
            address = builder.gep(buffer, [word(offset)])
            arguments.append(builder.bitcast(address, next(remaining_types)))
        else:
            for k in range(n_words):
                kind = next(remaining_types)
                if not isinstance(kind, (ir.PointerType, ir.DoubleType)) and kind != word:
                    raise UnsupportedError
                address = builder.gep(buffer, [word(offset + k)])
                arguments.append(builder.load(builder.bitcast(address, kind.as_pointer())))
        offset += n_words

    returned = builder.bitcast(builder.gep(buffer, [word(1)]), result_type)
    exception = builder.bitcast(builder.alloca(ir.IntType(8).as_pointer()), exception_type)
    status = builder.call(function, [returned, exception, *arguments])
    builder.store(builder.sext(status, word), buffer)
    builder.ret_void()
    return str(module)
