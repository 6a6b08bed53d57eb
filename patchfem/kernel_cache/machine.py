"""Files of machine code that run without importing numba.

Numba takes half a second to be imported, before it can load a function from a cache of its own. So the machine code of a
function is stored here, together with an entry function that reads the arguments from a buffer of 8-byte words (status,
results, then arguments as numba flattens them). `load_file` loads this file by llvmlite.

This is possible for functions of floats, integers, arrays and tuples of these that call only the C library; numba compiles
others in every process. A file consists of one line of JSON and an object file.

A function is compiled in two steps. The first one makes LLVM code that names no CPU: numba translates the function and all
that it calls, and LLVM optimises them together with the entry function. The second one, without numba, adds the vector
instructions of this CPU where the function asks for them and emits the object file.
"""

import ctypes
import hashlib
import json
import re
import struct
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np

from ..disk import user_cache

# Status codes of a function that returned a value, and of one that returned None
NUMBA_SUCCESS_CODES = (0, -2)
# Type code of `struct` for each type of number that a function takes.
STRUCT_TYPE_CODES = {float: "d", int: "q", np.float64: "d", np.int64: "q"}
# Type code and words of the last tuples by their `id`. A run passes the same few in many calls.
_KNOWN_TUPLES: dict[int, tuple[object, str, bytes]] = {}
MAX_KNOWN_TUPLES = 64  # number of tuples, nested ones included, whose words are kept
# Bits of `numpy.ndarray.flags.num`, and those by which numba distinguishes arrays: orders, aligned, writeable
C_ORDER = 0x1
FORTRAN_ORDER = 0x2
NUMBA_FLAGS = C_ORDER | FORTRAN_ORDER | 0x100 | 0x400
# Portable code of the functions that numba compiled in this process, by the names of their files.
PORTABLE_CODES: dict[str, bytes] = {}


class UnsupportedError(Exception):
    """Function or argument that this module does not support."""


def convert_argument(value) -> tuple[str, bytes]:
    """Return the type code and the machine words (bytes) of an argument `value`.

    Raises UnsupportedError for a type that compiled code cannot take. Tuples are immutable, so that their words are kept.
    """
    code = STRUCT_TYPE_CODES.get(type(value))
    if code is not None:
        return code, struct.pack(code, value)
    if isinstance(value, np.ndarray):
        return _convert_array(value)
    if not isinstance(value, tuple):
        raise UnsupportedError(
            f"compiled code takes no argument of the type {type(value).__name__}"
        )

    # The tuple itself is kept too, so that no other object gets its `id`.
    known = _KNOWN_TUPLES.get(id(value))
    if known is None:
        codes, words = zip(*map(convert_argument, value)) if value else ((), ())
        known = value, f"{type(value).__name__}({','.join(codes)})", b"".join(words)
        if len(_KNOWN_TUPLES) >= MAX_KNOWN_TUPLES:
            _KNOWN_TUPLES.clear()
        _KNOWN_TUPLES[id(value)] = known
    return known[1:]


def _convert_array(array) -> tuple[str, bytes]:
    """Return the type code and the machine words (bytes) of an array."""
    words = 0, 0, array.size, array.itemsize, array.ctypes.data, *array.shape, *array.strides
    code = _name_array_type(array.dtype, array.ndim, array.flags.num)
    return code, struct.pack(f"{len(words)}q", *words)


@cache
def _name_array_type(dtype: np.dtype, n_dimensions: int, flags: int) -> str:
    """Return the type code of arrays with a type, a number of dimensions and flags (`numpy.ndarray.flags.num`)."""
    if flags & C_ORDER:
        # Numba too reads an array of both orders, such as a row, as one of C order.
        flags &= ~FORTRAN_ORDER
    return f"{dtype.str}{n_dimensions}-{flags & NUMBA_FLAGS}"


class LoadedFunction:
    """Loaded machine code of a function; a call takes its arguments as machine words in bytes.

    Parameters
    ----------
    address : int
        Address of the machine code in memory.
    results : str
        Characters of the results, as in `struct`.
    is_tuple : bool
        Whether the function returns a tuple of them.
    """

    def __init__(self, address: int, results: str, *, is_tuple: bool):
        # PYFUNCTYPE keeps the global interpreter lock during the call.
        self.call = ctypes.PYFUNCTYPE(None, ctypes.c_void_p)(address)
        self.results = results
        self.is_tuple = is_tuple
        # Words of the status and of the results, which precede the arguments.
        self.header = bytes(8 * (1 + max(len(results), 1)))

    def __call__(self, words: bytes):
        """Call the function and return its result.

        RuntimeError is raised if the function raised an exception. `words` are the machine words of all arguments.
        """
        buffer = bytearray(self.header + words)
        self.call(ctypes.addressof(ctypes.c_char.from_buffer(buffer)))
        status = struct.unpack_from("q", buffer)[0]
        if status not in NUMBA_SUCCESS_CODES:
            raise RuntimeError(f"compiled code ended with status {status}")
        values = struct.unpack_from(self.results, buffer, 8)
        if self.is_tuple:
            return values
        return values[0] if values else None


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
        engine = _create_engine()
        engine.add_object_file(_import_binding().ObjectFileRef.from_data(code))
        engine.finalize_object()
        address = engine.get_function_address(header["name"])
        return LoadedFunction(address, header["results"], is_tuple=header["is_tuple"])
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
    function : jit.InlinedDispatcher
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
    try:
        target, result = compiler(function, arguments)
        header = {
            "name": "patchfem_" + hashlib.sha256(path.name.encode()).hexdigest()[:16],
            **_describe_result(result.signature.return_type),
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
        builder = create_pass_builder(target_machine, is_vectorised=True)
        builder.getModulePassManager().run(module, builder)

    # What is declared but not defined here must be found in the C library when the code is loaded.
    symbols = (*module.functions, *module.global_variables)
    declared = [symbol.name for symbol in symbols if symbol.is_declaration]
    called = [name for name in declared if not name.startswith("llvm.")]
    if not all(map(_is_in_c_library, called)):
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


def _describe_result(kind) -> dict[str, object]:
    """Return `LoadedFunction.results` and `LoadedFunction.is_tuple` by name, for a result of the numba type `kind`.

    Raises UnsupportedError for types that compiled code cannot return.
    """
    from numba.core import types

    is_tuple = isinstance(kind, types.BaseTuple)
    kinds = kind.types if is_tuple else (kind,)
    codes = {types.float64: "d", types.int64: "q", types.none: ""}
    if not codes.keys() >= set(kinds):
        raise UnsupportedError
    return {"results": "".join(codes[one] for one in kinds), "is_tuple": is_tuple}


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
    n_result_words = max(len(header["results"]), 1)
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
    builder = create_pass_builder(create_target_machine())
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


def create_pass_builder(target_machine, *, is_vectorised: bool = False):
    """Return the builder of the optimisation passes of LLVM, of level 1 for any CPU and of level 3 for this one.

    Parameters
    ----------
    target_machine
        Machine of LLVM for which the passes optimise.
    is_vectorised : bool
        Whether loops may become vector instructions, which belong to a CPU.
    """
    level = 3 if is_vectorised else 1
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
