"""Decorator `njit` of all kernels, which compiles helper functions only within their callers.

Numba optimises every function separately, adds wrappers for calls from Python and C and emits machine code, and repeats
most of this work in every caller: the body of a nested call is compiled about once per level of the nesting. A function
without `cache=True` skips these steps here. Its LLVM code is linked into its callers without optimisation, and each
caller is optimised once with all that it calls. If Python calls such a function, it is compiled separately.
"""

from functools import wraps
from types import SimpleNamespace

import numba
from numba.core import typed_passes, types, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager
from numba.core.options import DefaultOptions
from numba.core.registry import CPUDispatcher
from numba.core.types.functions import BaseFunction

from .cache_files import kept_on_disk
from .pass_by_reference import held

# options of numba that omit the wrappers through which C and Python call a function
NO_C, NO_PYTHON = (
    {flag: True} if hasattr(DefaultOptions, flag) else {}
    for flag in ("no_cfunc_wrapper", "no_cpython_wrapper")
)
# Functions that allocate nothing need no reference counting, which took 1.3 of the 1.6 us of a time step.
NJIT_NO_REFCOUNT = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
# Functions that only compiled code calls need no wrappers, which take most of their compile time.
NJIT_INTERNAL = NJIT_NO_REFCOUNT | NO_C | NO_PYTHON
# Numba's passes that the kernels need. The omitted ones handle closures, generators, `with`, lists, raise and array
# expressions, which no kernel contains; they took a seventh of the compile time of a loop.
PASSES = [
    getattr(home, name, None)
    for home, names in (
        (
            untyped_passes,
            (
                "TranslateByteCode",
                "FixupArgs",
                "IRProcessing",
                "RewriteSemanticConstants",
                "DeadBranchPrune",
                "GenericRewrites",
                "ReconstructSSA",
            ),
        ),
        (
            typed_passes,
            (
                "NopythonTypeInference",
                "PreLowerStripPhis",
                "IRLegalization",
                "NativeLowering",
                "NoPythonBackend",
            ),
        ),
    )
    for name in names
]
HOOKS = (
    "_optimize_final_module",
    "_finalize_final_module",
    "_finalize_dynamic_globals",
    "get_pointer_to_function",
)


def njit(cache: bool = False, **options):
    """Return `numba.njit`, or a decorator that compiles a function only within its callers.

    Parameters
    ----------
    cache : bool
        Whether the machine code is stored on disk, as by `numba.njit`. Other functions are compiled only within their
        callers; if this version of numba lacks the methods `HOOKS`, `numba.njit` compiles them.
    **options
        Options of `numba.njit`.
    """
    if numba.config.DISABLE_JIT:
        return lambda function: function
    if cache or not all(hasattr(JITCodeLibrary, name) for name in HOOKS):
        made = numba.njit(**NO_C, **options)
        return (lambda function: kept_on_disk(made(function))) if cache else made
    return lambda function: Inner(
        function, {}, {"nopython": True, "boundscheck": None, **options}, Inside
    )


def _remembered(ask):
    """Memoize the method `get_call_type`, by which numba resolves a call of a built-in function.

    Numba tries all overloads of the function, some dozens for a sum of two numbers, at each of the 4000 calls of a
    loop, which took a seventh of its compile time. A signature that depends on more than the types of the arguments is
    not stored: that of an overload written in Python, which numba compiles with the flags of the caller.
    """
    known = {}

    @wraps(ask)
    def meant(self, context, args, kws):
        key = self, tuple(args)
        if not kws and key in known:
            signature = known[key]
            self._impl_keys[signature.args] = self.typing_key
            return signature
        signature = ask(self, context, args, kws)
        if (
            not kws
            and signature is not None
            and self._impl_keys.get(signature.args) is self.typing_key
        ):
            known[key] = signature
        return signature

    return meant


if all(hasattr(BaseFunction, name) for name in ("get_call_type", "get_impl_key")):
    BaseFunction.get_call_type = _remembered(BaseFunction.get_call_type)


class Inner(CPUDispatcher):
    """Dispatcher of a function that is compiled only within the compiled functions that call it."""

    def __init__(self, function, names, options, compiler):
        super().__init__(function, names, options | NO_C | NO_PYTHON, compiler)
        self._alone, self._kept = CPUDispatcher(function, names, options | NO_C), False

    def get_call_template(self, args, kws):
        """Resolve a call by the types of its arguments, not by the values of constants.

        Otherwise numba would compile the function again for every constant argument.
        """
        if not self.targetoptions.get("forceinline"):
            args = tuple(map(types.unliteral, args))
        return super().get_call_template(args, kws)

    def __call__(self, *arguments):
        return self._alone(*arguments)

    def enable_caching(self):
        """Store the machine code for calls from Python on disk."""
        if not self._kept:
            kept_on_disk(self._alone)
            self._kept = True

    def alone(self) -> CPUDispatcher:
        """Return the dispatcher for calls from Python, whose machine code is stored on disk."""
        self.enable_caching()
        return self._alone


def optimised(function, arguments: tuple) -> tuple:
    """Compile a function to optimised LLVM code, but not to machine code.

    This saves a tenth of the compile time.

    Parameters
    ----------
    function : numba dispatcher
    arguments : tuple
        Arguments by whose types the function is compiled.

    Returns
    -------
    target : numba target context
    result : numba CompileResult

    Raises
    ------
    NotImplementedError
        If this version of numba lacks the methods `HOOKS`.
    """
    if not all(hasattr(JITCodeLibrary, name) for name in HOOKS):
        raise NotImplementedError
    bare = CPUDispatcher(
        function.py_func, function.locals, function.targetoptions | NO_C | NO_PYTHON, Whole
    )
    kinds = tuple(held(bare.typeof_pyval(one)) for one in arguments)
    bare.compile(kinds)
    return bare.targetctx, bare.overloads[kinds]


class Inside(Compiler):
    """Compiler that stops at LLVM code without optimisation, which callers link in."""

    part = property(lambda self: Part)  # class of the library that holds the LLVM code

    def define_pipelines(self):
        self.state.library = self.part(
            self.state.targetctx.codegen(), self.state.func_id.func_qualname
        )
        if not all(PASSES):
            return super().define_pipelines()
        passes = PassManager("nopython")
        for one in PASSES:
            passes.add_pass(one, one.__name__)
        passes.finalize()
        return [passes]


class Whole(Inside):
    """Compiler that stops at optimised LLVM code of a function and all that it calls."""

    part = property(lambda self: Optimised)


class Part(JITCodeLibrary):
    """LLVM code of a function before optimisation, which is linked into its callers."""

    # Without machine code, no environment of Python objects has to be registered.
    codegen = SimpleNamespace(set_env=lambda name, environment: None)

    def _optimize_functions(self, module):
        """Run the LLVM passes for single functions on every function that has a body."""
        module.data_layout = self._codegen._data_layout
        for one in module.functions:
            if not one.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(one, builder)

    def _optimize_final_module(self):
        pass

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name):
        self._ensure_finalized()
        return 0


class Optimised(Part):
    """LLVM code of a function and of all that it calls; it is optimised but has no address."""

    def _optimize_final_module(self):
        """Run all LLVM passes, but not the preceding ones that numba needs for reference counting."""
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)
