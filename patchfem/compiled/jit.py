"""`njit` of all compiled code: a function that others call becomes machine code together with them, not before.

Numba optimises every function for itself, makes it callable from Python and from C and turns it into machine code, then
does most of that again in each function that calls it: a loop is compiled about as often as it is deep. Here a function
that is not kept on disk gets none of that. Its code goes as it was written into the functions that call it, where all
is optimised once. A call of it from Python compiles it for itself.
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

# who does not call it
NO_C, NO_PYTHON = (
    {flag: True} if hasattr(DefaultOptions, flag) else {}
    for flag in ("no_cfunc_wrapper", "no_cpython_wrapper")
)
# no counting of references in functions that allocate nothing: 1.3 of the 1.6 us of a step of a march
NJIT_NO_REFCOUNT = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
# of functions that compiled code alone calls: their wrappers for Python take most of the time of compiling them
NJIT_INTERNAL = NJIT_NO_REFCOUNT | NO_C | NO_PYTHON
# of numba's passes those that our texts need: no closure, generator, `with`, list, raise or expression of arrays is in
# them, and what numba would look for in vain took a seventh of the time of compiling a loop
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
    """numba.njit for functions kept on disk, cache=True; for others one that compiles them inside their callers alone.

    options: those of numba.njit. Where numba's compiler is not the one this was written for, it is numba.njit.
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
    """Numba's answer to what a call of one of its own functions means, kept for the next call with the same types.

    It goes through all functions of that name, some dozens for a sum of two numbers, at each of the 4000 calls of a
    loop: a seventh of the time of compiling it. What depends on more than the types, its functions in Python that it
    compiles along with ours under their flags, is asked each time.
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
    """A function for other compiled functions."""

    def __init__(self, function, names, options, compiler):
        super().__init__(function, names, options | NO_C | NO_PYTHON, compiler)
        self._alone, self._kept = CPUDispatcher(function, names, options | NO_C), False

    def get_call_template(self, args, kws):
        """As numba's, of the types alone: else a call with another constant would be another function to compile."""
        if not self.targetoptions.get("forceinline"):
            args = tuple(map(types.unliteral, args))
        return super().get_call_template(args, kws)

    def __call__(self, *arguments):
        return self._alone(*arguments)

    def enable_caching(self):
        """Keep on disk what calls from Python compile."""
        if not self._kept:
            kept_on_disk(self._alone)
            self._kept = True

    def alone(self) -> CPUDispatcher:
        """The function for itself, for calls from Python, kept on disk."""
        self.enable_caching()
        return self._alone


def optimised(function, arguments: tuple) -> tuple:
    """(target, numba's result) of compiling a function, numba's dispatcher, for arguments of these types up to code
    that is optimised and not yet that of the machine: a tenth of the time less. NotImplementedError where numba's
    compiler is not the one this was written for."""
    if not all(hasattr(JITCodeLibrary, name) for name in HOOKS):
        raise NotImplementedError
    bare = CPUDispatcher(
        function.py_func, function.locals, function.targetoptions | NO_C | NO_PYTHON, Whole
    )
    kinds = tuple(held(bare.typeof_pyval(one)) for one in arguments)
    bare.compile(kinds)
    return bare.targetctx, bare.overloads[kinds]


class Inside(Compiler):
    """Numba's compiler up to the code that others take in."""

    part = property(lambda self: Part)  # what holds it

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
    """Numba's compiler up to code that is optimised with all that it calls."""

    part = property(lambda self: Optimised)


class Part(JITCodeLibrary):
    """Code of a function that is not optimised yet and has no address."""

    # there is no machine code that could look it up
    codegen = SimpleNamespace(set_env=lambda name, environment: None)

    def _optimize_functions(self, module):
        """The passes of a function alone, of those that have a body."""
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
    """Code of a function and of all that it calls, optimised, without an address."""

    def _optimize_final_module(self):
        """All passes of LLVM, without the cheap ones that numba has before them for its counting of references."""
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)
