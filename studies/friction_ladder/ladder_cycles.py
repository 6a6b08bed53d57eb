"""A steady cycle of every law of the ladder along a sine slide, and the error of one against another.

Slides are in bond lengths, forces in shares of mu_s N.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import today

from patchfem.friction import BondGrowth, Bonds
from patchfem.friction.bonds.list_numbers import cutoff_age
from patchfem.time_steps.contacts import BondSum, Contact, PointSet
from patchfem.time_steps.laws import make_bonds, make_cells, make_list
from patchfem.time_steps.slides import follow

HERTZ = 143.0  # [Hz] frequency of the loops
LENGTH = 2e-6  # [m] bond length
RATIO = 0.7  # kinetic friction / static friction
GROWTH = {"ratio": RATIO, "growth": BondGrowth(10.0, 0.05 * LENGTH, 1e-4)}
AMPLITUDES = (0.1, 0.3, 1.0, 3.0, 12.5, 50.0)  # amplitudes of the loops in bond lengths
STEPS = 4800  # steps per cycle
AT_ONCE = 1e4  # factor on both rates of 2.10 that leaves only its steady state


class Cycle(NamedTuple):
    """Steady cycle: slide increments (n,) in bond lengths and path-mean force (n,) in mu_s N."""

    dq: np.ndarray
    force: np.ndarray

    @property
    def area(self) -> float:
        return float(self.force @ self.dq)

    def over(self, every: int) -> "Cycle":
        """Return the same cycle with longer steps."""
        dq = self.dq.reshape(-1, every).sum(axis=1)
        return Cycle(dq, (self.force * self.dq).reshape(-1, every).sum(axis=1) / dq)


def _harmonic(amplitude: float, steps: int = STEPS) -> np.ndarray:
    """Return the slide (k,) [bond lengths] of whole cycles, the last one after a path of at least 20 bond lengths."""
    cycles = 1 + int(np.ceil(20 / (4 * amplitude)))
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * steps + 1) / steps)


def last_cycle(contact: Contact, amplitude: float, steps: int = STEPS) -> Cycle:
    """Return the last cycle of points whose lengths are in metres and whose friction limit is 1."""
    path = LENGTH * _harmonic(amplitude, steps)
    motion = follow(contact, np.arange(path.size) / (HERTZ * steps), path)
    if motion.n_unsolved:
        raise ArithmeticError("a step did not converge")
    return Cycle(np.diff(path)[-steps:] / LENGTH, motion.mean[-steps:])


def bonds(share: float = 1.0, **more) -> Bonds:
    """Return the law with mu_s = 1 and a bond length of the given share."""
    return Bonds(share, share * LENGTH, **more)


def points(law: Bonds) -> Contact:
    """Return a point of a law under 1 N."""
    return Contact([PointSet(make_bonds(law, 1.0), np.ones(1))], law.static, law.length)


def at_once() -> Bonds:
    """Return the law whose bond length is always the steady one at the present speed: LuGre, z' = v - |v| z/eps_eq(v)."""
    growth = GROWTH["growth"]
    fast = growth._replace(
        rest_growth=AT_ONCE * growth.rest_growth, slip_growth=growth.slip_growth / AT_ONCE
    )
    return bonds(ratio=RATIO, growth=fast)


def printed_law_cycle(amplitude: float, order: float, steps: int, **growth) -> Cycle:
    """Compute the last cycle of the law as printed, in which every bond has its own length.

    The list is merged to 0.01 bond lengths, an error of 1e-4 of the limit.

    Parameters
    ----------
    amplitude : float
        In bond lengths.
    order : float
    steps : int
        Steps per cycle.
    **growth
        Growth of the bond length.
    """
    law = bonds(order=order, reading="report", **growth)
    bond_sum = BondSum(law, cutoff_age(order, 1e-5), 0.01)
    points = PointSet(make_list(law, 1.0), np.ones(1), bond_sum=bond_sum)
    contact = Contact([points], law.static, law.length)
    return last_cycle(contact, amplitude, steps)


def error(found: Cycle, wanted: Cycle) -> tuple:
    """Return the area error of a cycle over 4 A, and the rms of its force difference over the steps."""
    if found.dq.size != wanted.dq.size:
        few = min(found.dq.size, wanted.dq.size)
        found, wanted = (cycle.over(cycle.dq.size // few) for cycle in (found, wanted))
    return (
        float((found.area - wanted.area) / np.abs(wanted.dq).sum()),
        float(np.sqrt(np.mean((found.force - wanted.force) ** 2))),
    )


def coulomb(like: Cycle, limit: float = 1.0) -> Cycle:
    return Cycle(like.dq, limit * np.sign(like.dq))


def make_sliders(limits, lengths) -> Contact:
    """Return parallel Jenkins elements of friction limits [N] that yield at given slides [m]."""
    law = make_cells(np.array(limits, float), np.array(lengths, float), 1.0)
    return Contact([PointSet(law, np.ones(1))], float(np.sum(limits)), LENGTH)


def elastic_plastic(amplitude: float, share: float = 1.0) -> Cycle:
    """Return one Jenkins element with the stiffness mu_s N/eps_0 and the limit share mu_s N."""
    return last_cycle(make_sliders([share], [share * LENGTH]), amplitude)


def iwan(amplitude: float, count: int, scale: float = 1.0) -> Cycle:
    stiffness, limit = today.iwan_elements(count, scale)
    return last_cycle(make_sliders(stiffness * limit, limit * LENGTH), amplitude)


def bouc_wen(amplitude: float, power: float) -> Cycle:
    """Return the Bouc-Wen law with gamma = beta = 1/2; the mean of a step is the mean of both ends."""
    steps = 200 if amplitude <= 1 else STEPS
    path = (
        _harmonic(amplitude, steps)[-2 * steps - 1 :]
        if amplitude > 1
        else _harmonic(amplitude, steps)
    )
    z = today.bouc_wen(path, power)[-steps - 1 :]
    return Cycle(np.diff(path)[-steps:], (z[1:] + z[:-1]) / 2)


def rate(like: Cycle) -> Cycle:
    """Return the law tanh(v/v_0) with the v_0 that is closest to `like` at this amplitude and frequency."""
    share = like.dq / np.abs(like.dq).max()
    return Cycle(like.dq, np.tanh(share / today.best_rate(share, like.force)))
