"""Several compiled laws as one module that asks numbers[0] for the law.

It is written beside the compiled code.
"""

from functools import cache

from ... import compiled

COULOMB = "friction.laws.coulomb_kernels"
SIGNATURES = {
    "solve_step": "numbers, memory, free, compliance",
    "step_bond_length": "numbers, memory, velocity, dt",
    "mean_force": "numbers, memory, rel_disp, increment, bond_length, dt",
    "update_memory": "numbers, memory, increment, force, v0, v1, dt, bond_length",
    "read_memory": "numbers, memory, rel_disp, velocity",
}
HEAD = '''"""Laws side by side: numbers[0] says which one is meant. Written by patchfem.dynamics.interfaces.dispatch."""

from patchfem.compiled.jit import njit

{imports}
from patchfem.friction.flags_kernels import NJIT_NO_REFCOUNT
'''
FUNCTION = """

@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def {name}({signature}):
{calls}"""


def number_of(laws: tuple) -> dict:
    """Return numbers[0] of every law by its module: 0 for Coulomb's law, else from 1 on.

    The loops treat Coulomb's law apart, because it has no slope.
    """
    return {COULOMB: 0} | {
        law: k for k, law in enumerate((law for law in laws if law != COULOMB), 1)
    }


@cache
def law_of(laws: tuple):
    """Return the compiled module of one law, or one that is written for several laws.

    laws: modules. The written module is kept beside the compiled code.
    """
    if len(laws) == 1:
        return compiled.load(laws[0])
    numbers = number_of(laws)
    text = ""
    for name, signature in SIGNATURES.items():
        calls = [f"    return law_{numbers[law]}.{name}({signature})\n" for law in laws]
        asked = [
            f"    if numbers[0] == {numbers[law]}:\n    {call}" for law, call in zip(laws, calls)
        ]
        text += FUNCTION.format(
            name=name, signature=signature, calls="".join([*asked[:-1], calls[-1]])
        )
    text = (
        HEAD.format(
            imports="\n".join(f"import patchfem.{law} as law_{numbers[law]}" for law in laws)
        )
        + text
    )
    return compiled.write_kernel_module(
        f"dynamics.interfaces.laws_{compiled.hash_text(text)}", text
    )
