"""The text of a step of several motions at once: the Taylor series of one mode under a sine and a law, unrolled.

A force that is built of a solution w of dw/dy = a + b w + c w^2 over the slide or its speed y, as tanh and exponentials
are, has the coefficients of its series by recurrence, and with it the motion: order ORDER costs half of a Runge-Kutta
step of order 8, tells its own length beforehand, and shows the motion everywhere inside. A loop over motions whose body
has neither loops, branches nor calls becomes vector code: eight motions take a step in the time of one.
Source: Moore, Interval Analysis (1966), ch. 11; Jorba and Zou, Experimental Mathematics 14 (2005) 99.
"""

from functools import cache

import numpy as np

from ... import compiled

LANES = 8  # motions side by side: doubles of the widest vectors
ORDER = 16  # of the series of the speed: a power of two, for its root
TERMS = ORDER + 1  # of a step seen as a polynomial in the share of it
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)  # for the energies that pass in a step
# rows of the array: numbers of a motion
GIVEN = ("stiff", "damp", "gain", "push", "steady", "pace", "phase", "slide", "origin", "n0", "n1", "n2", "n3",
         "rough")
STATE = ("t", "h", "unit", "z0", "v0", "crest", "fast", "allowed")  # before the step
SERIES = (*(f"v{k}" for k in range(1, ORDER + 1)), *(f"f{k}" for k in range(ORDER)), "bound", "change")
AFTER = ("z", "v", "a", "work", "power", "loss", "rub", "low", "high", "defect")
ROWS = {name: row for row, name in enumerate((*GIVEN, *STATE, *SERIES, *AFTER))}
SIZE = LANES * len(ROWS)
NOISE = 2e-15  # of the forces of mode, law and drive, of which the phase has lost digits: round-off of the acceleration

HEAD = '''"""Series of {lanes} motions of one mode under a sine: written by `dynamics.smooth.lane_step`."""

from math import sqrt

import {law} as law
from patchfem.compiled.inner import njit
from patchfem.compiled.series_kernels import sine
from patchfem.friction.flags_kernels import LEAN
'''
FUNCTION = '''

@njit(error_model="numpy", fastmath={{"contract"}}, **LEAN)
def {name}(rows):
    for k in range({lanes}):
'''


def _product(a: str, b: str, k: int) -> str:
    """Coefficient k of the product of two series."""
    return " + ".join(f"{a}{i} * {b}{k - i}" for i in range(k + 1))


def _square(k: int) -> str:
    """Coefficient k of w^2."""
    pairs = [f"2 * w{i} * w{k - i}" for i in range((k + 1) // 2)]
    return " + ".join([*pairs, f"w{k // 2} * w{k // 2}"] if k % 2 == 0 else pairs)


def _rise(grows: tuple, k: int) -> str:
    """Coefficient k of a + b w + c w^2."""
    a, b, c = grows
    parts = [repr(a)] if k == 0 and a else []
    parts += [f"{b!r} * w{k}"] if b else []
    parts += [f"{c!r} * ({_square(k)})"] if c else []
    return " + ".join(parts)


def _polynomial(terms: list, at: str) -> str:
    """Horner's form of a polynomial with these coefficients, the constant first."""
    text = terms[-1]
    for term in terms[-2::-1]:
        text = f"{term} + {at} * ({text})"
    return text


def _series(law) -> list:
    """Lines that make the coefficients of speed and force in units of time, their bound, and the change of the unit."""
    y = "v" if law.OF_SPEED else "z"
    lines = ["turn = pace * t + phase", "s, c, e, q0 = sine(turn), sine(turn + 1.5707963267948966), pace * unit, push",
             "d0 = steady + push * s", "reach = n0 * slide",
             "y0 = reach * v0" if law.OF_SPEED else "y0 = n0 * (slide * z0 - origin)", "w0 = law.share(y0)"]
    for k in range(ORDER):
        force = f"n2 * w{k}" + (f" + n3 * (y{k} - ({_product('y', 'w', k)}))" if law.MIXED else "")
        lines += [f"f{k} = n1 + {force}" if k == 0 else f"f{k} = {force}"]
        lines += [f"v{k + 1} = unit * {1 / (k + 1)!r} * (-damp * v{k} - stiff * z{k} - gain * f{k} - d{k})",
                  f"z{k + 1} = unit * {1 / (k + 1)!r} * v{k}", f"y{k + 1} = reach * {y}{k + 1}",
                  f"x{k} = {_rise(law.GROWS, k)}", f"w{k + 1} = {1 / (k + 1)!r} * ("
                  + " + ".join(f"{float(j)!r} * y{j} * x{k + 1 - j}" for j in range(1, k + 2)) + ")"]
        wave = ("c", "-s", "-c", "s")[k % 4]
        lines += [f"q{k + 1} = q{k} * e * {1 / (k + 1)!r}", f"d{k + 1} = q{k + 1} * {wave}"]
    last = max(i for i, line in enumerate(lines) if line.startswith(f"v{ORDER} = "))
    root = "x"
    for _ in range(ORDER.bit_length() - 1):
        root = f"sqrt({root})"
    return [*lines[:last + 1], "bound = allowed * max(max(fast, abs(v0)), 1e-30)",
            f"bound += {NOISE} * unit * ((stiff + rough) * abs(z0) + (1 + 0.2 * abs(turn)) * abs(push))",
            f"x = max(abs(v{ORDER}), abs(v{ORDER - 1})) / bound + 1e-300", f"change = 1 / {root}"]


def _moved() -> list:
    """Lines that move a motion on by h [s] and sum up what passes on the way."""
    speeds, forces = [f"v{k}" for k in range(ORDER + 1)], [f"f{k}" for k in range(ORDER)]
    ways = ["v0", *(f"v{k} * {1 / (k + 1)!r}" for k in range(1, ORDER + 1))]
    rates = ["v1", *(f"{float(k)!r} * v{k}" for k in range(2, ORDER + 1))]
    lines = ["c = h / unit", f"v = {_polynomial(speeds, 'c')}", f"z = z0 + h * ({_polynomial(ways, 'c')})",
             f"rate = ({_polynomial(rates, 'c')}) / unit",
             "force = law.along(n0, n1, n2, n3, slide * z - origin, slide * v)",
             "a = -damp * v - stiff * z - gain * force - steady - push * sine(pace * (t + h) + phase)",
             "defect = h * abs(a - rate) / bound", "work, power, loss, rub, low, high = 0.0, 0.0, 0.0, 0.0, v0, v0"]
    for node, weight in zip(NODES.tolist(), WEIGHTS.tolist()):
        lines += [f"x = {(1 + node) / 2!r} * c", f"vx = {_polynomial(speeds, 'x')}", f"fx = {_polynomial(forces, 'x')}",
                  "p = vx * (steady + push * sine(pace * (t + x * unit) + phase))", "low = min(low, vx)",
                  "high = max(high, vx)", f"work -= {weight / 2!r} * p", f"power += {weight / 2!r} * abs(p)",
                  f"loss += {weight / 2!r} * vx * vx", f"rub += {weight / 2!r} * vx * fx"]
    return [*lines, "work *= h", "power *= h", "loss *= h * damp", "rub *= h * slide"]


def text_of(law) -> str:
    """Text of the module whose series(rows) makes the series of LANES motions, and moved(rows) moves them on.

    law: the module of its kernels. rows (SIZE,): LANES numbers of each of ROWS. stiff [1/s2], damp [1/s], gain =
    slide/mass; the drive times the base share of the mode is steady + push sin(pace t + phase) [m s-2]; origin [m] of
    the slide, n0 to n3 of the law's `along`; rough [1/s2]: stiffness of the law over mass; t, h [s]; unit [s] of the
    time in the series; coordinate z0 and rate v0 at the start of the step; the largest of late and the tolerance.
    `series`: v1 .. and f0 .. are coefficients of the rate and of the force in powers of time over unit; bound [m/s] of
    the error of a step; change: of unit, at which the last terms of the rate make up the bound. `moved`: z, v,
    acceleration a after the step of h; work, loss, rub: integrals of minus drive times rate, damp v^2 and force times
    slide speed, power of |drive times rate|; low, high: the least and the largest rate at the nodes of these; defect:
    what a is beside the slope of the series, times h over bound.
    """
    parts = (("series", (*GIVEN, *STATE), _series(law), SERIES),
             ("moved", (*GIVEN, *STATE, *SERIES), _moved(), AFTER))
    text = HEAD.format(lanes=LANES, law=law.__name__)
    for name, given, lines, found in parts:
        body = [*(f"{one} = rows[{LANES * ROWS[one]} + k]" for one in given), *lines,
                *(f"rows[{LANES * ROWS[one]} + k] = {one}" for one in found)]
        text += FUNCTION.format(name=name, lanes=LANES) + "".join(f"        {line}\n" for line in body)
    return text


@cache
def step_of(law, say=None):
    """The compiled step for the law of a module of kernels, as `compiled.load` gives it."""
    text = text_of(law)
    return compiled.written(f"dynamics.smooth.lane_step_{compiled.digest(text)}", text, say, [law])
