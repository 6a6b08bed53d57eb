"""What does each rung of the friction laws buy? A sine slide of 143 Hz, amplitude A of 0.1 to 50 bond lengths.

Rungs: report (p = 1, as printed: every bond grows its own length, force against u/|u|) -> stretch (p = 1, one bond
length for all, 2.10) -> LuGre (bond length always that of the steady speed, z' = v - |v| z/eps_eq(v)) -> constant bond
length (Dahl) -> elastic-plastic (3.12) -> Coulomb; beside them what is in use: Iwan (parallel elastic-plastic
elements), Bouc-Wen, tanh. eps_0 = 2 um, growth eps_k/eps_0 = 0.7, a_s = 10 m/s2, l_k = eps_0/20 (v_c = 1 mm/s, the
peak speed at A = 0.56), v_h = 0.1 mm/s. Errors in steady cycles of 4800 steps: loop area as a share of 4 A mu_s N, and
(rms of the force over mu_s N). LuGre here is the stretch law with a_s and 1/l_k times 1e4 (v_c as it was); an
integration of its equation at A = 1 differs by less than 4e-6 in every step mean.

Growth off, against the constant length, which then is the stretch and LuGre as well:

    A/eps_0                 0.1            0.3            1              3              12.5           50
    report p = 1        -.003 (.64)    -.020 (.51)    -.049 (.24)    -.001 (.11)     .000 (.072)    .000 (.050)
    elastic-plastic     -.003 (.003)   -.029 (.027)   -.238 (.29)    -.002 (.14)     .000 (.092)    .000 (.065)
    Coulomb              .997 (1.00)    .971 (1.00)    .762 (.98)     .332 (.81)     .080 (.57)     .020 (.40)
    tanh, best v_0       .000 (.070)    .000 (.21)    -.001 (.52)    -.028 (.58)    -.037 (.41)    -.009 (.29)
    Bouc-Wen n = 1      -.002 (.002)   -.014 (.015)   -.090 (.087)   -.082 (.12)    -.020 (.086)   -.005 (.061)
    Bouc-Wen n = 2      -.003 (.003)   -.026 (.024)   -.123 (.15)    -.034 (.12)    -.008 (.083)   -.002 (.058)
    Iwan, virgin curve  -.002 (.004)   -.016 (.027)   -.135 (.15)    -.252 (.25)    -.080 (.19)    -.020 (.13)
    Iwan, reversals     +.003 (.058)   +.016 (.11)    +.032 (.076)   +.002 (.002)    .000 (.0000)   .000 (.0000)

Growth on: report, LuGre, constant against the rung above (the constants against LuGre), the rest against the stretch:

    report p = 1*       -.003 (.64)    -.020 (.50)    -.019 (.21)    +.007 (.11)    +.005 (.066)   +.005 (.038)
    LuGre                .000 (.0000)   .000 (.0000)   .000 (.0014)   .000 (.0019)   .000 (.0012)   .000 (.0008)
    LuGre, l_k = eps_0   .000 (.0000)   .000 (.0003)  -.004 (.007)   -.010 (.015)   -.001 (.005)    .000 (.001)
    constant, static     .000 (.0000)  -.001 (.001)   -.006 (.060)   +.131 (.22)    +.259 (.28)    +.290 (.29)
    constant, kinetic   +.001 (.001)   +.010 (.011)   +.019 (.052)    .000 (.029)    .000 (.007)    .000 (.002)
    elastic-plastic     -.003 (.003)   -.030 (.028)   -.035 (.11)     .000 (.073)    .000 (.054)    .000 (.040)
    Coulomb, kinetic     .697 (.70)     .670 (.71)     .455 (.70)     .163 (.54)     .039 (.37)     .010 (.26)

(* of the stretch. At 12.5 and 50 with 1600 steps: peaks of the printed law at reversals go on growing with the steps,
from .77 mu_s N to .87 at A = 50 from 200 to 1600; the area does not.)

Where is a rung enough?
- Coulomb misses (eps/A) tanh(A/eps) of the area, exactly: 1 % above A = 100 bond lengths. The rms of its force falls
  only as 1.06 (eps/A)^(1/4).
- Elastic-plastic: area within 1 % above A = 2.24 and below 0.17 (where there is none to speak of: A^2/3 of 4 A, and
  this law has 0 up to A = 1); its force is off by 14 % at A = 3 and still 6.5 % at 50, all of it just after reversals.
- Constant bond length: with mu_s while the peak speed stays below v_c/2 (A = 0.3: .001 and .001), with mu_k from 5 v_c
  on (A = 3: area to 4e-4, force 3 %; 12.5: 0.7 %). Between them neither: 5-6 % of force at A = 1.
- LuGre: everywhere while l_k is a small part of eps_0 (.002 in force at eps_0/20); 1 % of area at l_k = eps_0.
- Report against stretch: the print is stiff without limit in small cycles (0.64 mu_s N of force at A = 0.1) and agrees
  in area to 1 % from A = 3 on; its force differs by the reversals, 11 % there and 4-7 % above.
- At A = 0.1 all that counts is the stiffness mu_s N/eps_0: every law that has it is within .004 mu_s N, Coulomb is off
  by 1, the rate law by .07 with a v_0 chosen for this amplitude (237 times the peak speed; 0.26 of it at A = 50).
- Iwan with the virgin curve of Dahl unloads by Masing's rule at twice its scale: for A >> eps_0 its loop is one bond
  length short (4 mu N eps_0), a difference of model that no number of elements mends (5 elements: 2 % off in the virgin
  curve, 0.5/N^2; 100 elements: 5e-5). With half the yield slides it has the loops of Dahl from A = 3 on (100 elements:
  .002, 5 elements .014) and twice its first stiffness.
- Bouc-Wen with n = 1, gamma = 0 IS the constant bond length (to round-off); with gamma = beta it unloads on a line and
  lies between Dahl and elastic-plastic.
- Costs: costs.py. Nothing but the printed law costs more than 60 ns per step: the stretch twice the constant length.

Run: python studies/friction_ladder/ladder.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import today

from patchfem.dynamics.march.models import jenkins_model, list_model, load_kernels, points_model
from patchfem.friction.bonds.bond_kernels import list_mean, list_step
from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.bonds.quadrature import cutoff

loop_kernels = load_kernels()

HERTZ, LENGTH, RATIO = 143.0, 2e-6, 0.7
GROWTH = {"ratio": RATIO, "rest_growth": 10.0, "slip_growth": 0.05 * LENGTH, "rest_speed": 1e-4}
AMPLITUDES = (0.1, 0.3, 1.0, 3.0, 12.5, 50.0)  # bond lengths
STEPS = 4800  # per cycle
AT_ONCE = 1e4  # factor on both rates of 2.10 that leaves only its steady state


class Cycle(NamedTuple):
    """A steady cycle: increments dq (n,) in bond lengths, path-mean force (n,) in mu_s N."""

    dq: np.ndarray
    force: np.ndarray

    @property
    def area(self) -> float:
        return float(self.force @ self.dq)

    def over(self, every: int) -> "Cycle":
        """The same cycle seen in longer steps."""
        dq = self.dq.reshape(-1, every).sum(axis=1)
        return Cycle(dq, (self.force * self.dq).reshape(-1, every).sum(axis=1) / dq)


def harmonic(amplitude: float, steps: int = STEPS, path: float = 20.0) -> np.ndarray:
    """Slide (k,) [bond lengths] of whole cycles, the last of them after at least `path` bond lengths."""
    cycles = 1 + int(np.ceil(path / (4 * amplitude)))
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * steps + 1) / steps)


def followed(model, amplitude: float, steps: int = STEPS) -> Cycle:
    """Last of the cycles of a model of the hub whose lengths are in metres and whose limit is in mu_s N."""
    path = LENGTH * harmonic(amplitude, steps)
    contact, work = model.build(loop_kernels)
    forces, burnt = np.zeros((path.size, 3)), np.zeros((path.size, 2))
    if loop_kernels.follow_path(path, 1 / (HERTZ * steps), model.kind, contact, work, 1e-11, burnt, forces):
        raise ArithmeticError("a step did not converge")
    return Cycle(np.diff(path)[-steps:] / LENGTH, forces[-steps - 1:-1, 1])


def bonds(share: float = 1.0, **more) -> Bonds:
    """The law with mu_s = 1 and a share of the bond length."""
    return Bonds(share, share * LENGTH, **more)


def points(law: Bonds):
    return points_model(law, [1.0], [1.0])


def at_once() -> Bonds:
    """The law whose bond length is always the steady one of the speed: LuGre, z' = v - |v| z/eps_eq(v)."""
    fast = GROWTH | {"rest_growth": AT_ONCE * GROWTH["rest_growth"], "slip_growth": GROWTH["slip_growth"] / AT_ONCE}
    return bonds(**fast)


def printed(amplitude: float, order: float, steps: int, **growth) -> Cycle:
    """The law as printed, every bond of its own length, by the compiled list merged to 0.01 bond lengths (1e-4 of
    the limit); the means of the steps are asked for in the last cycle only."""
    law = bonds(order=order, reading="report", **growth)
    c, _ = list_model(law, 1.0, cutoff(order, 1e-5), 0.01).build(loop_kernels)
    path, dt, force = LENGTH * harmonic(amplitude, steps), 1 / (HERTZ * steps), []
    for i, dq in enumerate(np.diff(path)):
        args = (dq, c.bondlist, c.tally, c.now, c.law, c.growth, c.table, dq / dt)
        if i >= path.size - 1 - steps:
            force.append(list_mean(*args, dt))
        if not list_step(*args, dq / dt, dt):
            raise ArithmeticError("the bond list is full")
    return Cycle(np.diff(path)[-steps:] / LENGTH, np.array(force))


class Row(NamedTuple):
    """A rung at an amplitude [bond lengths]: loop area over 4 A mu_s N; (area, rms force) errors in shares of
    4 A mu_s N and mu_s N against the rung above and against the stretch with the same growth."""

    growth: str
    rung: str
    amplitude: float
    area: float
    above: tuple
    top: tuple


def error(found: Cycle, wanted: Cycle) -> tuple:
    """(area error over 4 A, rms of the force difference over the steps of a cycle) of `found`."""
    if found.dq.size != wanted.dq.size:
        few = min(found.dq.size, wanted.dq.size)
        found, wanted = (cycle.over(cycle.dq.size // few) for cycle in (found, wanted))
    return (float((found.area - wanted.area) / np.abs(wanted.dq).sum()),
            float(np.sqrt(np.mean((found.force - wanted.force)**2))))


def coulomb(like: Cycle, limit: float = 1.0) -> Cycle:
    return Cycle(like.dq, limit * np.sign(like.dq))


def elastic_plastic(amplitude: float, share: float = 1.0) -> Cycle:
    """One Jenkins element of stiffness mu_s N/eps_0 and the limit share mu_s N."""
    return followed(jenkins_model([1 / LENGTH], [share * LENGTH]), amplitude)


def iwan(amplitude: float, count: int, scale: float = 1.0) -> Cycle:
    stiffness, limit = today.iwan_elements(count, scale)
    return followed(jenkins_model(stiffness / LENGTH, limit * LENGTH), amplitude)


def bouc_wen(amplitude: float, power: float) -> Cycle:
    """gamma = beta = 1/2; the mean of a step is that of its ends."""
    steps = 200 if amplitude <= 1 else STEPS
    path = harmonic(amplitude, steps)[-2 * steps - 1:] if amplitude > 1 else harmonic(amplitude, steps)
    z = today.bouc_wen(path, power)[-steps - 1:]
    return Cycle(np.diff(path)[-steps:], (z[1:] + z[:-1]) / 2)


def rate(like: Cycle) -> Cycle:
    """tanh(v/v_0) with the v_0 that is nearest to `like` at this amplitude and frequency."""
    share = like.dq / np.abs(like.dq).max()
    return Cycle(like.dq, np.tanh(share / today.best_rate(share, like.force)))


def constant(amplitude: float, print_steps: int) -> list:
    """Rows without growth: every law against Dahl's, which is the stretch, LuGre and the constant length in one."""
    dahl = followed(points(bonds()), amplitude)
    sharp = elastic_plastic(amplitude)
    report = printed(amplitude, 1.0, print_steps)
    rows = [("report p = 1", report, None), ("stretch = LuGre = Dahl", dahl, report), ("elastic-plastic", sharp, dahl),
            ("Coulomb", coulomb(dahl), sharp), ("tanh, best v_0", rate(dahl), dahl)]
    rows += [(f"Bouc-Wen n = {n}", bouc_wen(amplitude, n), dahl) for n in (1, 2, 5)]
    rows += [(f"Iwan {n}, virgin curve", iwan(amplitude, n), dahl) for n in (5, 10, 20, 50, 100)]
    rows += [(f"Iwan {n}, reversal curve", iwan(amplitude, n, 0.5), dahl) for n in (5, 20, 100)]
    return _rows("off", amplitude, rows, dahl)


def growing(amplitude: float, print_steps: int) -> list:
    """Rows with growth: constant lengths are once eps_0 with mu_s and once eps_k with mu_k (the same stiffness)."""
    stretch, lugre = (followed(points(law), amplitude) for law in (bonds(**GROWTH), at_once()))
    kinetic = followed(points(bonds(RATIO)), amplitude)
    report, sharp = printed(amplitude, 1.0, print_steps, **GROWTH), elastic_plastic(amplitude, RATIO)
    rows = [("report p = 1", report, None), ("stretch", stretch, report), ("LuGre", lugre, stretch),
            ("constant eps_0, mu_s", followed(points(bonds()), amplitude), lugre),
            ("constant eps_k, mu_k", kinetic, lugre), ("elastic-plastic, mu_k", sharp, kinetic),
            ("Coulomb, mu_k", coulomb(sharp, RATIO), sharp)]
    return _rows("on", amplitude, rows, stretch) + slow_path(amplitude)


def slow_path(amplitude: float, times: float = 20.0) -> list:
    """LuGre against the stretch where the bond length follows over l_k = eps_0 of path, at the same v_c."""
    slow = GROWTH | {"slip_growth": times * GROWTH["slip_growth"], "rest_growth": GROWTH["rest_growth"] / times}
    stretch = followed(points(bonds(**slow)), amplitude)
    lugre = followed(points(at_once()), amplitude)
    return _rows("on, l_k = eps_0", amplitude, [("LuGre", lugre, stretch)], stretch)


def _rows(growth, amplitude, rows, top) -> list:
    return [Row(growth, name, amplitude, found.area / (4 * amplitude),
                (np.nan, np.nan) if above is None else error(found, above), error(found, top))
            for name, found, above in rows]


def main(amplitudes=AMPLITUDES, cost: bool = True) -> dict:
    """{(growth, rung, amplitude): Row}, printed; with `cost`, the table of costs.py after it."""
    out = {}
    for amplitude in amplitudes:
        steps = 200 if amplitude < 1 else 400 if amplitude < 10 else 1600
        for row in constant(amplitude, steps) + growing(amplitude, steps):
            out[row.growth, row.rung, row.amplitude] = row
    for growth in dict.fromkeys(row.growth for row in out.values()):
        for title, column in (("rung above", "above"), ("stretch", "top")):
            print(f"\ngrowth {growth}: area over 4 A mu_s N (rms force over mu_s N) against the {title}")
            print(f"{'A/eps_0':26}" + "".join(f"{a:>18g}" for a in amplitudes))
            for rung in dict.fromkeys(row.rung for row in out.values() if row.growth == growth):
                cells = (getattr(out[growth, rung, a], column) for a in amplitudes)
                print(f"{rung:26}" + "".join(f"{area:+9.4f} ({rms:.4f})" for area, rms in cells))
    if cost:
        import costs

        costs.main()
    return out


if __name__ == "__main__":
    main()
