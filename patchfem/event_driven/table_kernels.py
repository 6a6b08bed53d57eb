"""The functions of all laws as one compiled function each, which chooses the law by its number."""

from importlib import import_module

from ..kernel_cache.flags_kernels import NJIT_KERNEL
from ..kernel_cache.jit import njit
from .laws import LAWS


def _choose(number: int, function, other):
    """Return a compiled function that calls `function` if a law has this number, and else `other`.

    `other` is such a function for the laws that follow, so that the functions of all laws form a chain.
    """

    @njit(**NJIT_KERNEL)
    def choose(law, *arguments):
        """Call `function` if `law` is its number, else go on along the chain.

        The `arguments` are those of the function, as `laws` describes.
        """
        if law == number:
            return function(*arguments)
        return other(law, *arguments)

    return choose


def _end_chain(function):
    """Return a compiled function that calls that of the last law, whatever the number."""

    @njit(**NJIT_KERNEL)
    def call(law, *arguments):
        """Call the function of the last law with these arguments."""
        return function(*arguments)

    return call


def _join(name: str):
    """Return the compiled function of this name for all laws, a chain that compares the number of a law with each."""
    modules = [import_module(f"{__package__}.laws.{law}") for law in LAWS]
    functions = [njit(**NJIT_KERNEL)(getattr(module, name)) for module in modules]
    chain = _end_chain(functions[-1])
    for number, function in enumerate(functions[:-1]):
        chain = _choose(number, function, chain)
    return chain


def _compile_helpers(law: str) -> None:
    """Replace the Python functions in the list HELPERS of the module of a law by compiled ones."""
    module = import_module(f"{__package__}.laws.{law}")
    for name in getattr(module, "HELPERS", ()):
        setattr(module, name, njit(**NJIT_KERNEL)(getattr(module, name)))


for _law in LAWS:
    _compile_helpers(_law)
force_and_rates = _join("force_and_rates")
write_law_margins = _join("write_margins")
switch_law = _join("switch")
