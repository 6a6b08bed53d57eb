"""What the last cycles show: steps read off as polynomials against closed forms, and motions seen closely."""

from types import SimpleNamespace

import numpy as np
import pytest
from march_paths import OMEGA, one_mode
from scipy.optimize import brentq
from test_smooth import MASS

from patchfem.core import InitialState, Response, SineDrive
from patchfem.dynamics.smooth.arrays import NODE_FRACTIONS
from patchfem.dynamics.smooth.reader import StepParts
from patchfem.dynamics.smooth.run import Motion
from patchfem.friction import Bonds, TanhLaw, points_element

PERIOD, CYCLES = 0.7, 3


def parts(slide, slip=None, count: int = 61):
    """StepParts of functions of time [s], in `count` steps of uneven length."""
    edges = PERIOD * CYCLES * np.linspace(0, 1, count + 1) ** 1.2
    time = (edges[:-1, None] + np.diff(edges)[:, None] * NODE_FRACTIONS).ravel()
    none = np.zeros((time.size, 1))
    one = slide(time)
    return StepParts(
        Response(
            time,
            none,
            none,
            one,
            none[:, 0],
            one,
            none[:, 0],
            one,
            one,
            one,
            one if slip is None else slip(time),
            {},
        ),
        PERIOD,
    )


def test_exact_integrals_and_peaks_of_known_histories():
    omega = 2 * np.pi / PERIOD
    seen = parts(lambda t: 3 * np.cos(omega * t - 0.4) + np.sin(3 * omega * t) + 0.2 * t)
    dense = np.linspace(0, PERIOD * CYCLES, 2_000_001)
    curve = 3 * np.cos(omega * dense - 0.4) + np.sin(3 * omega * dense) + 0.2 * dense
    peak, unsure = seen.find_maximum(seen.values("slide"))
    assert peak == pytest.approx(curve.max(), rel=1e-9) and unsure < 1e-5
    # of 0.2 t over whole cycles
    line = 0.2 * 2 / (CYCLES * PERIOD) * CYCLES * PERIOD / (-1j * omega)
    assert seen.harmonic("slide") == pytest.approx(3 * np.exp(-0.4j) + line, rel=1e-9)
    assert seen.harmonic("slide", 3) == pytest.approx(-1j + line / 3, rel=1e-9)
    assert seen.drift() == pytest.approx(0.2 * PERIOD, rel=1e-8)
    assert seen.mean("slide", 0.1, 0.1 + PERIOD) == pytest.approx(
        0.2 * (0.1 + PERIOD / 2), rel=1e-9
    )


def test_exact_time_of_stick_and_starts_of_slip_are_where_half_of_the_slide_is_irreversible():
    omega = 2 * np.pi / PERIOD

    def share(t):
        return 0.5 + 0.4 * np.sin(2 * omega * t + 0.3)  # of the rate of the slide, in the slip

    slide = np.polynomial.Polynomial([0.0, 1.0])
    seen = parts(slide, lambda t: 0.5 * t - 0.2 * np.cos(2 * omega * t + 0.3) / omega)
    held, starts = seen.find_sticks()
    assert held == pytest.approx(PERIOD * CYCLES / 2, rel=1e-6)
    at = np.arange(-0.15, 2 * CYCLES * np.pi, np.pi) / omega
    wanted = [
        brentq(lambda t: share(t) - 0.5, t - 0.1, t + 0.1) for t in at if 0 < t < PERIOD * CYCLES
    ]
    assert len(starts) == len(wanted) and starts == pytest.approx(np.array(wanted), abs=1e-6)


def element(law, load):
    return points_element(law, [1.0], [load]) if isinstance(law, Bonds) else law.element(load)


def within(values) -> tuple:
    """Least and most of the largest of a number of which these are close samples: between two of them it rises no more
    than it falls beside the largest."""
    at = int(np.argmax(values))
    return values[at] * (1 - np.sign(values[at]) * 1e-9), 2 * values[at] - min(
        values[max(at - 1, 0) : at + 2]
    )


CASES = {  # law, load, damping, drive over resonance, drive, motion of the base
    "tanh": (TanhLaw(0.3, 0.00523108), 83.6747, 0.0185937, 153.949 / 143, 39.9675, True),
    "narrow": (TanhLaw(0.3, 1e-3), 83.6747, 0.0185937, 1.08, 40.0, True),
    "force": (TanhLaw(0.3, 0.00523108), 83.6747, 0.0185937, 1.08, 40.0, False),
    "bonds": (Bonds(0.3, 5e-6), 60.0, 0.003, 0.95, 40.0, True),
    "soft": (Bonds(0.3, 4e-5), 60.0, 0.01, 1.1, 30.0, False),
}


@pytest.mark.share(3, 4)
@pytest.mark.parametrize("name", CASES)
def test_exact_peaks_are_those_of_the_motion_seen_closely(name):
    """Of "tanh" the largest acceleration lay in steps that were left out after a look at their ends and middle, and
    came out 3.8e-6 too low."""
    law, load, zeta, ratio, push, moving = CASES[name]
    drive = SineDrive(push, ratio * OMEGA, moving)
    start = None if name == "tanh" else InitialState(np.full(1, 2e-5), np.zeros(1))
    modes = one_mode(OMEGA, zeta, MASS)
    run, close = (Motion(modes, drive, element(law, load), 40, 1e-9, start=start) for _ in range(2))
    end = 40 * drive.period
    begin = 30 * drive.period
    fine, _ = run.run_last_cycles(end, end - begin)[1]
    close.run_to(begin)
    close.tolerance *= 1e-2
    seen = close.response(close.run_to(end, np.linspace(begin, end, 100001)))
    for found, values in (
        (fine.acceleration_peak, np.abs(seen.acceleration)),
        (fine.loops[0].max_force, np.abs(seen.force)),
    ):
        least, most = within(values)
        assert least <= found <= most * (1 + 1e-9)
    # (2 pi/1e4)^2/8 between samples
    assert fine.loops[0].slip_range == pytest.approx(np.ptp(seen.slip), rel=1e-7)


def test_exact_a_step_of_no_length_adds_nothing_to_a_mean(recwarn):
    """As an event at the end of a step leaves one: the mean of x = t over [0.5, 1.5] is 1, and nothing is warned of."""
    edges = [(0.0, 1.0), (1.0, 1.0), (1.0, 2.0)]
    time = np.concatenate([begin + (end - begin) * NODE_FRACTIONS for begin, end in edges])
    found = StepParts(SimpleNamespace(time=time, slide=time), 1.0)
    assert found.mean("slide", 0.5, 1.5) == pytest.approx(1.0, rel=1e-14) and not recwarn.list
