"""Dispatch module that combines several compiled laws; numbers[0] selects the law.

It is generated and stored with the compiled code.
"""

from functools import cache

from ... import compiled

COULOMB_LAW = "friction.laws.coulomb_kernels"
SIGNATURES = {
    "solve_step": "numbers, memory, free, compliance",
    "step_bond_length": "numbers, memory, velocity, dt",
    "mean_force": "numbers, memory, rel_disp, increment, bond_length, dt",
    "update_memory": "numbers, memory, increment, force, v0, v1, dt, bond_length",
    "read_memory": "numbers, memory, rel_disp, velocity",
}
MODULE_HEAD = '''"""Several laws, of which numbers[0] selects one; written by patchfem.dynamics.interfaces.dispatch."""

from patchfem.compiled.jit import njit

{imports}
from patchfem.friction.flags_kernels import NJIT_NO_REFCOUNT
'''
FUNCTION_TEMPLATE = """

@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def {name}({signature}):
{calls}"""


def number_laws(laws: tuple) -> dict:
    """Return the number that selects each law module: 0 for Coulomb's law, 1 and above for the others.

    The loops treat Coulomb's law separately, because it has no slope.
    """
    return {COULOMB_LAW: 0} | {
        law: k for k, law in enumerate((law for law in laws if law != COULOMB_LAW), 1)
    }


@cache
def load_law(laws: tuple):
    """Load the compiled module of one law, or generate a dispatch module if there are several laws.

    laws: names of the law modules. The dispatch module is stored with the compiled code.
    """
    if len(laws) == 1:
        return compiled.load(laws[0])
    numbers = number_laws(laws)
    text = ""
    for name, signature in SIGNATURES.items():
        calls = [f"    return law_{numbers[law]}.{name}({signature})\n" for law in laws]
        conditional_calls = [
            f"    if numbers[0] == {numbers[law]}:\n    {call}" for law, call in zip(laws, calls)
        ]
        text += FUNCTION_TEMPLATE.format(
            name=name, signature=signature, calls="".join([*conditional_calls[:-1], calls[-1]])
        )
    text = (
        MODULE_HEAD.format(
            imports="\n".join(f"import patchfem.{law} as law_{numbers[law]}" for law in laws)
        )
        + text
    )
    return compiled.write_kernel_module(
        f"dynamics.interfaces.laws_{compiled.hash_text(text)}", text
    )
