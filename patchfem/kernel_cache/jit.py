"""Decorator `njit` of all kernels, which compiles helper functions only within their callers.

Numba optimises every function separately, adds wrappers for calls from Python and C and emits machine code, and repeats
most of this work in every caller: the body of a nested call is compiled about once per level of the nesting. These steps
are skipped here. The LLVM code of a function is linked into its callers without optimisation, and `machine` optimises each
function that Python calls once, with all that it calls.
"""

from types import SimpleNamespace

import numba
from numba.core import typed_passes, types, untyped_passes
from numba.core.base import BaseContext
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_machinery import PassManager
from numba.core.registry import CPUDispatcher

from .integer_enums import register_integer_enums
from .machine import create_pass_builder, create_target_machine
from .pass_by_reference import get_argument_type

# Options of numba that omit the wrappers through which C and Python call a function
NO_C_WRAPPER = {"no_cfunc_wrapper": True}
NO_PYTHON_WRAPPER = {"no_cpython_wrapper": True}
# Options for functions that allocate nothing and need no reference counting, which took
# 1.3 of the 1.6 us of a time step.
NJIT_NO_REFCOUNT = {"_nrt": False}
# Compiler passes of numba that the kernels need. The omitted ones handle closures, generators,
# `with`, lists, raise and array expressions, which no kernel contains; they took a seventh of the
# compile time of a loop.
NUMBA_PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)

register_integer_enums()


def njit(**options):
    """Return a decorator that compiles a function only within its callers.

    Parameters
    ----------
    **options
        Options of `numba.njit`. Numba hands `forceinline=True` on to every function that the decorated one calls, and to
        those that these call, unless they set `forceinline=False`. Only functions that call little may set it: the bond
        lists of a march, inlined at all calls, had four million lines of LLVM code.
    """
    if numba.config.DISABLE_JIT:
        return lambda function: function
    options = {"nopython": True, "boundscheck": None, **options}
    return lambda function: InlinedDispatcher(function, {}, options, UnoptimisedCompiler)


class InlinedDispatcher(CPUDispatcher):
    """Dispatcher of a function that is compiled only within the compiled functions that call it."""

    def __init__(self, function, names, options, compiler):
        super().__init__(function, names, options | NO_C_WRAPPER | NO_PYTHON_WRAPPER, compiler)
        self._standalone = CPUDispatcher(function, names, options | NO_C_WRAPPER)

    def get_call_template(self, args, kws):
        """Resolve a call by the types of its arguments, not by the values of constants.

        Otherwise numba would compile the function again for every constant argument.

        `args` and `kws` are the types of the arguments by position and by name.
        """
        if not self.targetoptions.get("forceinline"):
            args = tuple(map(types.unliteral, args))
        return super().get_call_template(args, kws)

    def __call__(self, *arguments):
        return self._standalone(*arguments)


def compile_unoptimised(
    function, arguments: tuple[object, ...]
) -> tuple[BaseContext, CompileResult]:
    """Compile a function to LLVM code that `machine` optimises, together with the entry function.

    Parameters
    ----------
    function : InlinedDispatcher
        Function before its compilation.
    arguments : tuple
        Arguments by whose types the function is compiled.

    Returns
    -------
    target : numba target context
    result : numba CompileResult
    """
    argument_types = tuple(get_argument_type(function.typeof_pyval(value)) for value in arguments)
    # Numba optimises its own functions for this CPU, whose vector instructions do not belong into portable code.
    is_vectorised = numba.config.LOOP_VECTORIZE
    numba.config.LOOP_VECTORIZE = False
    try:
        function.compile(argument_types)
    finally:
        numba.config.LOOP_VECTORIZE = is_vectorised
    return function.targetctx, function.overloads[argument_types]


class UnoptimisedCompiler(Compiler):
    """Compiler that stops at LLVM code without optimisation, which callers link in."""

    def define_pipelines(self):
        """Return the passes of numba that the kernels need, which write into this library."""
        self.state.library = UnoptimisedLibrary(
            self.state.targetctx.codegen(), self.state.func_id.func_qualname
        )
        passes = PassManager("nopython")
        for numba_pass in NUMBA_PASSES:
            passes.add_pass(numba_pass, numba_pass.__name__)
        passes.finalize()
        return [passes]


class UnoptimisedLibrary(JITCodeLibrary):
    """LLVM code of a function before optimisation, which is linked into its callers."""

    # Without machine code, no environment of Python objects has to be registered.
    codegen = SimpleNamespace(set_env=lambda name, environment: None)

    def _optimize_functions(self, module):
        """Run the LLVM passes for single functions on every function of a module that has a body.

        They are those for any CPU, because the code becomes portable code of `machine`.
        """
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            if not function.is_declaration:
                builder = create_pass_builder(create_target_machine())
                builder.getFunctionPassManager().run(function, builder)

    def _optimize_final_module(self):
        pass

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name):
        """Return 0 for the address of a function, whatever its name, because there is no machine code."""
        self._ensure_finalized()
        return 0
