"""The text of a step of several motions at once: the method of `tableau_kernels` for one mode under a sine, unrolled.

A loop over stages and their coefficients cannot become vector code, a loop over motions whose body has neither loops,
branches nor calls can: eight motions take a step in the time of one. Twin: `step_kernels.step`.
"""

from functools import cache

from ... import compiled
from .tableau_kernels import FIFTH, PLACES, SHARES, THIRD

LANES = 8  # motions side by side: doubles of the widest vectors
# rows of the array: numbers of a motion
GIVEN = ("stiff", "damp", "gain", "push", "steady", "pace", "phase", "slide", "origin", "n0", "n1", "n2", "n3")
STATE = ("t", "h", "z0", "v0", "a0", "d0", "f0", "crest", "fast", "allowed")  # before the step
AFTER = ("z12", "v12", "a12", "d12", "f12", "work", "loss", "rub", "error", "change")
ROWS = {name: row for row, name in enumerate((*GIVEN, *STATE, *AFTER))}
SIZE = LANES * len(ROWS)

HEAD = '''"""One step of order 8 of {lanes} motions of one mode under a sine: written by `dynamics.smooth.lane_step`."""

from math import sqrt

import {law} as law
from patchfem.compiled.inner import njit
from patchfem.compiled.series_kernels import sine
from patchfem.friction.flags_kernels import LEAN


@njit(error_model="numpy", fastmath={{"contract"}}, **LEAN)
def step(rows):
    for k in range({lanes}):
'''


def _sum(shares, name: str, times: str = "") -> str:
    parts = [f"{float(share)!r} * {name}{j}{times.replace('#', str(j))}" for j, share in enumerate(shares) if share]
    return " + ".join(parts)


def text_of(law: str) -> str:
    """Text of the module whose step(rows) takes a step of LANES motions; law: full name of the module of its kernels.

    rows (SIZE,): LANES numbers of each of ROWS. stiff [1/s2], damp [1/s], gain = slide/mass; d, the drive times the
    base share of the mode, is steady + push sin(pace t + phase) [m s-2]; origin [m] of the slide, n0 to n3 of the law's
    `along`; t, h [s]; coordinate z, its rate v, a, d and the force f at the start of the step; the largest z and v of
    late and the tolerance; the same five at the end; work, loss, rub: integrals of -d v, damp v^2 and force times slide
    speed; error: its estimate over what is allowed, as `step_kernels.missed` has it, and the change of the step's
    length that it asks for, without bounds.
    """
    lines = [f"{name} = rows[{LANES * ROWS[name]} + k]" for name in (*GIVEN, *STATE)]
    for stage in range(1, 13):
        shares, place = SHARES[stage, :stage], float(PLACES[stage])
        lines += [f"z{stage} = z0 + h * ({_sum(shares, 'v')})", f"v{stage} = v0 + h * ({_sum(shares, 'a')})",
                  f"d{stage} = steady + push * sine(pace * (t + {place!r} * h) + phase)",
                  f"f{stage} = law.along(n0, n1, n2, n3, slide * z{stage} - origin, slide * v{stage})",
                  f"a{stage} = -damp * v{stage} - stiff * z{stage} - gain * f{stage} - d{stage}"]
    last = SHARES[12, :12]
    lines += [f"work = -h * ({_sum(last, 'd', ' * v#')})", f"loss = h * damp * ({_sum(last, 'v', ' * v#')})",
              f"rub = h * slide * ({_sum(last, 'f', ' * v#')})"]
    for name, rate, size in (("z", "v", "crest"), ("v", "a", "fast")):
        lines += [f"largest = max(max({size}, abs({name}0)), max(abs({name}12), 1e-30))",
                  f"fifth_{name} = ({_sum(FIFTH, rate)}) / largest", f"third_{name} = ({_sum(THIRD, rate)}) / largest"]
    lines += ["fifth = fifth_z * fifth_z + fifth_v * fifth_v", "third = third_z * third_z + third_v * third_v",
              "error = h * fifth / (sqrt(2 * fifth + 0.02 * third + 1e-300) * allowed)",
              "change = 0.9 / sqrt(sqrt(sqrt(error)))"]
    lines += [f"rows[{LANES * ROWS[name]} + k] = {name}" for name in AFTER]
    return HEAD.format(lanes=LANES, law=law) + "".join(f"        {line}\n" for line in lines)


@cache
def step_of(law, say=None):
    """The compiled step for the law of a module of kernels, as `compiled.load` gives it."""
    text = text_of(law.__name__)
    return compiled.written(f"dynamics.smooth.lane_step_{compiled.digest(text)}", text, say, [law])
