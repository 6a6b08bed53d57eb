"""The functions of all laws as one compiled function each, which chooses the law by its number."""

from importlib import import_module

from ..compiled.flags_kernels import NJIT_KERNEL
from ..compiled.jit import njit
from .laws import LAWS
from .records import Friction


@njit(**NJIT_KERNEL)
def _no_force(law, p, memory, point, s, rates):
    """Return no force: the end of the chain of laws, for a number that none of them has.

    `law` is the number, and the numbers `p`, the `memory`, the motion (`point`), the states `s` and the `rates` of the
    law are not used.
    """
    return Friction(0.0, 0.0, 0.0)


@njit(**NJIT_KERNEL)
def _no_margins(law, p, memory, point, s, margins):
    """Write no margins: the end of the chain of laws, for a number that none of them has.

    `law` is the number, and the numbers `p`, the `memory`, the motion (`point`), the states `s` and the `margins` of the
    law are not used.
    """
    pass


@njit(**NJIT_KERNEL)
def _no_switch(law, p, memory, point, s, which):
    """Return False, at the end of the chain of laws: the regime does not change.

    `law` is the number, and the numbers `p`, the `memory`, the motion (`point`) and the states `s` of the law are not
    used, nor is the `Margin` at which the regime would change, `which`.
    """
    return False


def _choose(number: int, function, other):
    """Return a compiled function that calls that of a law by its number, or the other one."""

    @njit(**NJIT_KERNEL)
    def choose(law, p, memory, point, s, last):
        """Call the function of the law with this number, else the rest of the chain.

        Parameters
        ----------
        law : int
            Number of a law in `LAWS`.
        p : (k,) array
            Numbers of the law.
        memory : (l,) array
            Row of `records.State.memory`.
        point : Point
            Load and motion of the interface.
        s : (j,) array
            States of the law.
        last : array or int
            Rates or margins that are written, or the `Margin` at which the regime changes.
        """
        if law == number:
            return function(p, memory, point, s, last)
        return other(law, p, memory, point, s, last)

    return choose


def _join(name: str, function):
    """Return the compiled function of this name for all laws."""
    for number, law in enumerate(LAWS):
        module = import_module(f"{__package__}.laws.{law}")
        function = _choose(number, njit(**NJIT_KERNEL)(getattr(module, name)), function)
    return function


def _compile_helpers(law: str) -> None:
    """Replace the functions that the functions of a law call by compiled ones."""
    module = import_module(f"{__package__}.laws.{law}")
    for name in getattr(module, "HELPERS", ()):
        setattr(module, name, njit(**NJIT_KERNEL)(getattr(module, name)))


for _law in LAWS:
    _compile_helpers(_law)
force_and_rates = _join("force_and_rates", _no_force)
write_law_margins = _join("write_margins", _no_margins)
switch_law = _join("switch", _no_switch)
