"""How far does a block creep under a biased dither that never reaches its friction limit? Bond lengths per cycle.

Quasi-static force control at the pace of 143 Hz: force held at .5 +- .1, .5 +- .3 and .3 +- .3 of mu_s N under the load
N, load +- 10 % and +- 20 % (first down) at .5, and both together (force .5 +- .1, load -+ 10 %; each change in four
pieces: .289 and .0013 of p = 1 are .290 and .0015 with sixteen). Last of 12 cycles, the second in brackets where it
differs. eps_0 and growth as in friction_ladder; p = 0 starts without bonds (full-grown ones are a Coulomb jump), the
other orders with them.

    law                      .5+-.1         .5+-.3         .3+-.3         load 10 %  load 20 %  both
    Coulomb                  0              0              0              0          0          0
    elastic-plastic          0              0              0              0          0          0
    Iwan, 10 elements        0              0              0              0          0          0 (.002)
    tanh, v_0 = 1 mm/s       1.93           2.03           1.12           1.93       1.96       1.97
    Bouc-Wen n = 2           .0695          .296           .0931
    stretch p = 1, b = 0     .272           .981           .446           0          0          .289
                   b = .1    0              .811           .357           0          0          .0013
                   b = .3    0              0              0              0          0          0
    stretch p = .5, b = 0    .066 (.080)    .380           .103 (.123)    0          0          .091
                    b = .1   0              .243 (.28)     .045           0          0          0
    stretch p = 2, b = 0     .782 (.70)     2.21           1.32           0          0          .817
                   b = .1    .306 (.18)     2.03           1.23           0          0          .399 (.26)
                   b = .3    0              1.29           .880           0          0          0
    stretch p = 0, b = 0     .0003 (.019)   .0013 (.069)   .0011 (.057)   .205       .442       .196
                   b >= .1   0              .0002, 0       .0002, 0       .205       .442       .310
    report p = 0             .0003 (.019)   .0013 (.069)   .0011 (.057)   0          0          .0003
    report p = 1             .0014 (.098)   .0038 (.23)    .0032 (.19)    0          0          .0014
    growing: stretch b = 0   .279           away           .495           0          0          .301
                     b = .1  .0014          away           .406           0          0          .0031
                     b = .3  0              away           .033           0          0          0
    report p = 1, growing    .0014          .0038          .0032          0          0          .0014

(b = .5, and b = .3 of p = 0.5: 0 in every column, but for p = 0 under a changing load and "away".)

Why. Coulomb, elastic-plastic and Iwan close every loop within the limit. The constant stretch p = 1 is Dahl's law: its
way up, ln((1 - low)/(1 - high)), is longer than its way down,
for ever (`closed_forms.dither_drift`). With an elastic
range nothing breaks within 2 b mu_s N of swing: 0 from the second cycle on. Growth shortens that range with the bonds
(eps_k/eps_0 at most): b = .3 then leaves .033 at +- .3. "away": at 143 Hz a force of .8 speeds the block up until less
than .8 is left of its friction, and no slide of one step holds it. Bouc-Wen (gamma = beta) unloads on a line and goes
up on a curve. tanh holds nothing: v_0 atanh(F/(mu N)) for as long as the force acts. A load that changes at rest moves
none of them but p = 0, where every bond carries all it has as soon as it forms and none is idle to be let go. The print
locks up: bonds that are infinitely stiff against small cycles pile up, the drift falls as 1/n^2 over n cycles (p = 1:
.098, .030, .006, .0014 at n = 2, 3, 6, 12), and comes with energy out of nothing for p > 0. It is no cure.

What an elastic range costs, against b = 0 (Dahl): the loop gets b (1 - b) bond lengths narrower, 4 b (1 - b) mu_s N
eps_0 of work, from A = 3 on, and has no area at all below A = b. Area over 4 A mu_s N, and (rms force):

    A/eps_0    0.1            0.3            1              3              12.5           50             virgin curve
    b = 0.1   -.003 (.003)   -.014 (.015)   -.048 (.050)   -.030 (.056)   -.007 (.039)   -.002 (.028)   +.005
    b = 0.3   -.003 (.003)   -.029 (.028)   -.088 (.086)   -.069 (.11)    -.017 (.077)   -.004 (.054)   +.041
    b = 0.5   -.003 (.003)   -.029 (.028)   -.085 (.085)   -.082 (.12)    -.020 (.086)   -.005 (.061)   +.107
    of which b = 0 has (area)  .003   .029   .238   .668   .920   .980

Which default? The table speaks for b = 0 where there is no biased dither: the law is 2.17 as it stands, and every
b > 0 gives up loop area, most where it is scarce (a fifth of it at A = 1 and b = .1, 37 % at b = .3). It speaks for
b > 0 wherever a mean force and a dither act together and the mean position matters: set b to half the swing of the
force in shares of mu_s N, and eps_0/eps_k times that if the bond length grows; b = .1 for +- .1 costs 3 % of area at
A = 3 (.030 of .668: 4 %) and less than 1 % from A = 12.5 on. p = 2 needs more than half the swing, the print no b.

Run: python studies/drift/drift_table.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "friction_ladder"))
import ladder
import today
from force_control import OutOfReach, slides

from patchfem.friction.bonds.quadrature import Quadrature
from patchfem.friction.bonds.recursion import Recursion
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.friction.protocol import Step

LENGTH, PERIOD, CYCLES, CREEP = ladder.LENGTH, 1 / ladder.HERTZ, 12, 1e-3
SHARES = (0.0, 0.1, 0.3, 0.5)  # breakaway
CASES = {"force .5+-.1": ((0.6, 0.4), (1.0, 1.0)), "force .5+-.3": ((0.8, 0.2), (1.0, 1.0)),
         "force .3+-.3": ((0.6, 0.0), (1.0, 1.0)), "load +-10 %": ((0.5, 0.5), (0.9, 1.1)),
         "load +-20 %": ((0.5, 0.5), (0.8, 1.2)), "both": ((0.6, 0.4), (0.9, 1.1))}


class Iwan:
    """Parallel elastic-plastic elements as one law, with the virgin curve of Dahl."""

    def __init__(self, count: int, length: float):
        k, s = today.iwan_elements(count)
        self.parts = [ElasticPlastic(float(a * b), float(b) * length) for a, b in zip(k, s)]

    def start(self, sigma):
        return [part.start(sigma) for part in self.parts]

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
    """Drift per cycle in bond lengths: over the second and over the last cycle; None where the block slides
    away."""

    law: str
    case: str
    second: float | None
    last: float | None


def engines(growth: bool, orders=(0.0, 0.5, 1.0, 2.0), shares=SHARES) -> dict:
    """name -> law object of the bond laws; order 0 starts without bonds, as full-grown ones would be a Coulomb jump."""
    more, tail = (ladder.GROWTH, ", growing") if growth else ({}, "")
    out = {}
    for p in orders:
        for b in shares:
            law = ladder.bonds(order=p, breakaway=b, initial=float(p > 0), **more)
            out[f"stretch p = {p:g}, b = {b:g}{tail}"] = Recursion(law) if p == 1 else Quadrature(law, 1e-9)
    for p in (0.0, 1.0):
        law = ladder.bonds(order=p, reading="report", initial=p, **more)
        out[f"report p = {p:g}{tail}"] = Quadrature(law, 1e-9)
    return out


def small() -> dict:
    """Laws without bonds that answer a force."""
    return {"elastic-plastic": ElasticPlastic(1.0, LENGTH), "Iwan, 10 elements": Iwan(10, LENGTH)}


def row(name: str, engine, case: str, cycles: int = CYCLES) -> Row:
    forces, loads = CASES[case]
    pieces = 4 if len(set(forces)) > 1 and len(set(loads)) > 1 else 1
    try:
        ends = slides(engine, forces, loads, cycles, pieces, PERIOD, LENGTH) / LENGTH
    except OutOfReach:
        return Row(name, case, None, None)
    return Row(name, case, float(ends[1] - ends[0]), float(ends[-1] - ends[-2]))


def closed(case: str) -> list:
    """Rows of the laws whose answer needs no march: Coulomb holds below its limit; tanh creeps at v_0 atanh(F/(mu N))
    along straight ramps of force and load; Bouc-Wen (n = 2, gamma = beta, constant load) goes up by the integral of
    1/(1 - z^2) and comes back on a line."""
    (high, low), (first, second) = CASES[case]
    held = max(high / first, low / second) < 1
    rows = [Row("Coulomb", case, *(0.0 if held else None,) * 2)]
    mean = quad(lambda s: np.arctanh((low + s * (high - low)) / (second + s * (first - second))), 0, 1)[0]
    creep = CREEP * mean * PERIOD / LENGTH
    rows.append(Row(f"tanh, v_0 = {1e3 * CREEP:g} mm/s", case, creep, creep))
    if first == second:
        walk = np.arctanh(high) - np.arctanh(low) - (high - low)
        rows.append(Row("Bouc-Wen n = 2", case, walk, walk))
    return rows


def breakaway_cost(amplitudes=ladder.AMPLITUDES, shares=SHARES) -> dict:
    """{(b, A/eps_0): (area error over 4 A mu_s N, rms force error)} of the elastic range against Dahl's law."""
    out = {}
    for amplitude in amplitudes:
        dahl = ladder.followed(ladder.points(ladder.bonds()), amplitude)
        for b in shares:
            out[b, amplitude] = ladder.error(ladder.followed(ladder.points(ladder.bonds(breakaway=b)), amplitude), dahl)
    return out


def virgin_gap(share: float) -> float:
    """Greatest excess of the virgin curve over 1 - exp(-x): at x = b, where the damage begins."""
    return share + np.expm1(-share)


def main(laws=None, cases=tuple(CASES), growing: bool = True) -> dict:
    """{(law, case): Row}, printed as a markdown table; laws: {name: law object}, all of them by default."""
    if laws is None:
        laws = small() | engines(False) | (engines(True) if growing else {})
    out = {(found.law, case): found for case in cases for found in closed(case)}
    for name, engine in laws.items():
        out |= {(name, case): row(name, engine, case) for case in cases}
    print("| drift per cycle [bond lengths]: last (second) | " + " | ".join(cases) + " |\n" + "|---" * (len(cases) + 1)
          + "|")
    for name in dict.fromkeys(name for name, _ in out):
        cells = (out.get((name, case)) for case in cases)
        print(f"| {name} | " + " | ".join(_cell(cell) for cell in cells) + " |", flush=True)
    return out


def _cell(found) -> str:
    if found is None:
        return ""
    if found.last is None:
        return "away"
    last, second = (0.0 if abs(v) < 1e-9 else v for v in (found.last, found.second))
    return f"{last:.4g}" if abs(last - second) < 1e-6 else f"{last:.4g} ({second:.3g})"


if __name__ == "__main__":
    main()
    print("\nbreakaway b against b = 0: area over 4 A mu_s N (rms force), virgin curve")
    cost = breakaway_cost()
    for b in SHARES:
        print(f"b = {b:3}: " + "  ".join(f"A {a:g}: {cost[b, a][0]:+.4f} ({cost[b, a][1]:.4f})"
                                         for a in ladder.AMPLITUDES) + f"  virgin {virgin_gap(b):.4f}")
