"""The laws of the drift study as contact points: bond laws of every order, Iwan's elements, closed forms."""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad

sys.path.insert(0, str(Path(__file__).parents[1] / "friction_ladder"))
import ladder_cycles as ladder
import today

from patchfem.friction import Bonds
from patchfem.friction.bonds.list_numbers import cutoff_age
from patchfem.time_steps import laws
from patchfem.time_steps.contacts import BondSum, Contact, PointSet

LENGTH = ladder.LENGTH  # [m] bond length
PERIOD = 1 / ladder.HERTZ  # [s] duration of a cycle
CUT_OFF = 1e-9  # largest part of the friction limit that the cut-off of a list leaves out
CREEP = 1e-3  # [m/s] reference speed of the law tanh
CASES = {
    "force .5+-.1": ((0.6, 0.4), (1.0, 1.0)),
    "force .5+-.3": ((0.8, 0.2), (1.0, 1.0)),
    "force .3+-.3": ((0.6, 0.0), (1.0, 1.0)),
    "load +-10 %": ((0.5, 0.5), (0.9, 1.1)),
    "load +-20 %": ((0.5, 0.5), (0.8, 1.2)),
    "both": ((0.6, 0.4), (0.9, 1.1)),
}


def make_bonds(law: Bonds):
    """Return the function of a load that makes a point of bonds."""
    is_first_order = law.reading == "stretch" and law.order == 1
    bond_sum = None if is_first_order else BondSum(law, cutoff_age(law.order, CUT_OFF), 0.0)
    points = laws.make_bonds(law, 1.0) if is_first_order else laws.make_list(law, 1.0)
    point_sets = [PointSet(points, np.zeros(0), bond_sum=bond_sum)]
    return lambda load: Contact(point_sets, law.static, law.length, load=load)


def make_springs(stiffness, yield_slide):
    """Return the function of a load that makes parallel elastic-plastic elements, with forces (t,) per load [1]."""
    limits = np.multiply(stiffness, yield_slide)
    points = PointSet(laws.make_cells(limits, np.array(yield_slide, float), 1.0), np.zeros(0))
    return lambda load: Contact([points], float(limits.sum()), load=load)


class Row(NamedTuple):
    """Drift per cycle in bond lengths, over the second and over the last cycle; None if the block slides away."""

    law: str
    case: str
    second: float | None
    last: float | None


def engines(growth: bool, orders=(0.0, 0.5, 1.0, 2.0)) -> dict:
    """Return {name: function of a load that makes the point} of the bond laws.

    Order 0 starts without bonds, because with fully grown bonds it would be a Coulomb jump.
    """
    more, tail = (ladder.GROWTH, ", growing") if growth else ({}, "")
    out = {}
    for p in orders:
        law = ladder.bonds(order=p, initial=float(p > 0), **more)
        out[f"stretch p = {p:g}{tail}"] = make_bonds(law)
    for p in (0.0, 1.0):
        law = ladder.bonds(order=p, reading="report", initial=p, **more)
        out[f"report p = {p:g}{tail}"] = make_bonds(law)
    return out


def laws_without_bonds() -> dict:
    """Return the laws without bonds that respond to a given force, as `engines` does."""
    stiffness, yield_slide = today.iwan_elements(10)
    iwan = make_springs(stiffness / LENGTH, yield_slide * LENGTH)
    return {"elastic-plastic": make_springs([1 / LENGTH], [LENGTH]), "Iwan, 10 elements": iwan}


def closed_form_rows(case: str) -> list:
    """Return rows of the laws whose drift is known in closed form.

    Coulomb holds below its limit. The law tanh creeps at v_0 atanh(F/(mu N)) along straight ramps of force and load.
    Bouc-Wen (n = 2, gamma = beta, constant load) rises by the integral of 1/(1 - z^2) and returns on a line.
    """
    (high, low), (first, second) = CASES[case]
    held = max(high / first, low / second) < 1
    rows = [Row("Coulomb", case, *(0.0 if held else None,) * 2)]
    mean = quad(
        lambda s: np.arctanh((low + s * (high - low)) / (second + s * (first - second))), 0, 1
    )[0]
    creep = CREEP * mean * PERIOD / LENGTH
    rows.append(Row(f"tanh, v_0 = {1e3 * CREEP:g} mm/s", case, creep, creep))
    if first == second:
        walk = np.arctanh(high) - np.arctanh(low) - (high - low)
        rows.append(Row("Bouc-Wen n = 2", case, walk, walk))
    return rows
