"""The laws of the drift study as objects: bond laws of every order, Iwan's elements, closed forms."""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad

sys.path.insert(0, str(Path(__file__).parents[1] / "friction_ladder"))
import ladder_cycles as ladder
import today

from patchfem.friction import Step
from patchfem.friction.bonds.points import FirstOrderBonds, ListedBonds
from patchfem.friction.laws.elastic_plastic import ElasticPlastic

LENGTH = ladder.LENGTH  # [m] bond length
PERIOD = 1 / ladder.HERTZ  # [s] duration of a cycle
CREEP = 1e-3  # [m/s] reference speed of the law tanh
CASES = {
    "force .5+-.1": ((0.6, 0.4), (1.0, 1.0)),
    "force .5+-.3": ((0.8, 0.2), (1.0, 1.0)),
    "force .3+-.3": ((0.6, 0.0), (1.0, 1.0)),
    "load +-10 %": ((0.5, 0.5), (0.9, 1.1)),
    "load +-20 %": ((0.5, 0.5), (0.8, 1.2)),
    "both": ((0.6, 0.4), (0.9, 1.1)),
}


class Iwan:
    """Parallel elastic-plastic elements as one law, with the virgin curve of Dahl."""

    def __init__(self, count: int, length: float):
        k, s = today.iwan_elements(count)
        self.parts = [ElasticPlastic(float(a * b), float(b) * length) for a, b in zip(k, s)]

    def initial_state(self, sigma):
        return [part.initial_state(sigma) for part in self.parts]

    def step(self, state, dq, s0, s1, dt) -> Step:
        return self._sum([part.step(one, dq, s0, s1, dt) for part, one in zip(self.parts, state)])

    def press(self, state, s0, s1) -> Step:
        return self._sum([part.press(one, s0, s1) for part, one in zip(self.parts, state)])

    def traction(self, state):
        return sum(part.traction(one) for part, one in zip(self.parts, state))

    def _sum(self, steps) -> Step:
        mean, spent, state = zip(*steps)
        return Step(sum(mean), sum(spent), list(state))


class Row(NamedTuple):
    """Drift per cycle in bond lengths, over the second and over the last cycle; None if the block slides away."""

    law: str
    case: str
    second: float | None
    last: float | None


def engines(growth: bool, orders=(0.0, 0.5, 1.0, 2.0)) -> dict:
    """Return {name: law} of the bond laws.

    Order 0 starts without bonds, because with fully grown bonds it would be a Coulomb jump.
    """
    more, tail = (ladder.GROWTH, ", growing") if growth else ({}, "")
    out = {}
    for p in orders:
        law = ladder.bonds(order=p, initial=float(p > 0), **more)
        out[f"stretch p = {p:g}{tail}"] = FirstOrderBonds(law) if p == 1 else ListedBonds(law)
    for p in (0.0, 1.0):
        law = ladder.bonds(order=p, reading="report", initial=p, **more)
        out[f"report p = {p:g}{tail}"] = ListedBonds(law)
    return out


def laws_without_bonds() -> dict:
    """Return the laws without bonds that respond to a given force."""
    return {"elastic-plastic": ElasticPlastic(1.0, LENGTH), "Iwan, 10 elements": Iwan(10, LENGTH)}


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
