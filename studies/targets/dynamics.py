"""Which targets of the dynamics are met, on this machine, now?

All of accuracy, and of the times those of the event engine, of the bonds and of harmonic balance; not that of a march
step for 100 elements, and of 200 cycles in plain Python hardly. CPU seconds of one core, least of several turns, four
runs on a machine that was shared by up to nine others all the while. Event engine: 1.9 to 2.1 us for a cycle of
stick-slip in a long run (wanted 3), 1460 to 2100 times less than DOP853 with events at 1e-8 and 770 to 970 times less
than the fastest CVODE run (300); 20 to 33 ms for 200 cycles in plain Python (20: met in a quiet turn alone); 8.2 to
9.0 us for a steady point (10, 66 to 74 times less than its plain form). March: 280 to 310 ns per step for 100 elements
on five modes (200), 515 to 710 ns with the samples and energies that a run keeps (200), 250 to 380 ns for 30 elements
on ten modes (300), 0.25 to 0.32 us for 200 points of bonds on ten modes (3), 5.9 to 13 us with 16 shear modes (15).
Harmonic balance of 100 elements with 15 harmonics takes 2.4 to 3.5 ms a point (5), 6 to 9 times less than 200 cycles
of the march.

The same step took 195 ns on this machine when it was idle, and the state of the package of that day takes as long as
today's beside it, turn by turn: 281 to 344 beside 267 to 284 ns, 449 to 647 beside 520 to 530 ns with what a run keeps.
Harmonic balance was 1.2 ms then, and is 1.2 to 1.4 times slower than that state: what it calls is short, and a
call of machine code kept in a file takes longer than one through numba.

Run: python studies/targets/dynamics.py [--alone]      (--alone: without the peers that are not Python's own)
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path

from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parent))
from dynamics_events import CYCLES, cycle_of_events, cycle_of_peer, steady_point
from dynamics_march import STEPS, balance, basis, bonded, elements, step
from dynamics_plain import per_step, sharp, soft

from patchfem.core import Missing
from patchfem.dynamics.march.models import jenkins_model


@dataclass(frozen=True, eq=False, slots=True)
class Target:
    """What is measured [s, or 1 where `unit` is empty], its limit, and what it is compared with in the same run;
    `ratio`: so many times faster than that is wanted."""

    text: str
    number: Callable
    limit: float
    unit: str = "s"
    beside: str = ""
    other: Callable | None = None
    ratio: float = 0.0


PEER = "SUNDIALS"
TARGETS = (
    Target("stick-slip, a cycle of a long run", lambda: cycle_of_events()[0], 3e-6, "s", "DOP853 + events, 1e-8",
           lambda: cycle_of_peer("DOP853"), 300),
    Target("the same", lambda: cycle_of_events()[0], 3e-6, "s", f"fastest {PEER} run to 1e-3",
           lambda: cycle_of_peer(PEER), 300),
    Target("its error, peak after 200 cycles", lambda: cycle_of_events()[1], 1e-12, ""),
    Target("steady point by the event map", lambda: steady_point()[0], 10e-6),
    Target("its error", lambda: steady_point()[1], 1e-10, ""),
    Target("step, 5 modes, 100 elements", lambda: step(basis(5), jenkins_model(*elements(100))), 200e-9, "s", "NumPy",
           per_step(5, sharp(100))),
    Target("the same, samples and energies kept", lambda: step(basis(5), jenkins_model(*elements(100)), True), 200e-9),
    Target("step, 10 modes, 30 elements", lambda: step(basis(10), jenkins_model(*elements(30))), 0.3e-6, "s", "NumPy",
           per_step(10, sharp(30))),
    Target("step, 10 modes, 200 points of bonds", lambda: step(basis(10), bonded(200)), 3e-6, "s", "NumPy",
           per_step(10, soft(200))),
    Target("the same with 16 shear modes", lambda: step(basis(10), bonded(200, 16)), 15e-6, "s", "without them",
           lambda: step(basis(10), bonded(200))),
    Target("harmonic balance, 100 elements, 15 harmonics", balance, 5e-3, "s", "200 marched cycles",
           lambda: CYCLES * STEPS * step(basis(5), jenkins_model(*elements(100)))))


def text_of(value: float, unit: str) -> str:
    """With the unit that suits its size."""
    if not unit:
        return f"{value:.2g}"
    size, name = next(((s, n) for s, n in ((1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")) if value >= s), (1e-9, "ns"))
    return f"{value / size:.3g} {name}"


def main(targets=TARGETS) -> dict:
    """{(text, beside): (measured, ratio or None, met)}, printed as a table."""
    out = {}
    print(f"{'target':46} {'wanted':>10} {'seen':>9}  met   times faster than")
    with threadpool_limits(1):
        for one in targets:
            value, ratio, words = one.number(), None, ""
            if one.other is not None:
                try:
                    ratio = one.other() / value if value > 0 else inf  # below what the clock of the process tells
                    words = f"{ratio:9.3g}  {one.beside}" + (f" (wanted {one.ratio:g})" if one.ratio else "")
                except Missing as missing:
                    words = f"        -  {one.beside}: {missing}"
            met = value <= one.limit and (ratio is None or ratio >= one.ratio)
            out[one.text, one.beside] = value, ratio, met
            print(f"{one.text:46} {'<= ' + text_of(one.limit, one.unit):>10} {text_of(value, one.unit):>9}  "
                  f"{'yes' if met else 'NO ':3} {words}", flush=True)
    return out


if __name__ == "__main__":
    main([one for one in TARGETS if PEER not in one.beside] if "--alone" in sys.argv[1:] else TARGETS)
