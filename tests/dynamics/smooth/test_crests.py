"""Peaks inside the steps of motions in lanes: those of the same motion seen closely, and those of polynomials."""

import numpy as np
import pytest
from march_paths import OMEGA, one_mode
from test_smooth import MASS

from patchfem.core import BaseSine, Start
from patchfem.dynamics.smooth import crest_kernels as crests
from patchfem.dynamics.smooth.run import Run
from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.laws.stretch import points_element
from patchfem.friction.laws.tanh import Rate


def element(law, load):
    return points_element(law, [1.0], [load]) if isinstance(law, Bonds) else law.element(load)


def within(values) -> tuple:
    """Least and most of the largest of a number of which these are close samples: between two of them it rises no more
    than it falls beside the largest."""
    at = int(np.argmax(values))
    return values[at] - 1e-10 * abs(values[at]), 2 * values[at] - min(values[max(at - 1, 0):at + 2])


CASES = {  # law, load, damping, drive over resonance, drive, motion of the base
    "tanh": (Rate(0.3, 0.00523108), 83.6747, 0.0185937, 153.949 / 143, 39.9675, True),
    "narrow": (Rate(0.3, 1e-3), 83.6747, 0.0185937, 1.08, 40.0, True),
    "force": (Rate(0.3, 0.00523108), 83.6747, 0.0185937, 1.08, 40.0, False),
    "bonds": (Bonds(0.3, 5e-6), 60.0, 0.003, 0.95, 40.0, True),
    "soft": (Bonds(0.3, 4e-5), 60.0, 0.01, 1.1, 30.0, False)}


@pytest.mark.share(3, 4)
@pytest.mark.parametrize("name", CASES)
def test_exact_peaks_are_those_of_the_motion_seen_closely(name):
    """Of "tanh" the largest acceleration lay in steps that were left out after a look at their ends and middle, and
    came out 3.8e-6 too low."""
    law, load, zeta, ratio, push, moving = CASES[name]
    drive = BaseSine(push, ratio * OMEGA, moving)
    start = None if name == "tanh" else Start(np.full(1, 2e-5), np.zeros(1))
    run = Run(one_mode(OMEGA, zeta, MASS), drive, element(law, load), 40, 1e-9, start=start)
    assert run.swift
    end, begin = 40 * drive.period, 30 * drive.period
    run.until(begin)
    run.kept.tally[:6] = -np.inf
    rows = run.until(end, np.linspace(begin, end, 100001), peaks=True)
    seen = run.response(rows)
    for found, values in zip(run.kept.tally, (np.abs(seen.acceleration), np.abs(seen.force), seen.slip, -seen.slip)):
        least, most = within(values)
        assert least <= found <= most


def test_exact_largest_value_of_a_polynomial():
    """Against the turns that NumPy finds; nothing where what is known is more, nor of round-off around it."""
    random, room, powers = np.random.default_rng(3), np.zeros((crests.ROWS, crests.TERMS + 2)), np.arange(crests.TERMS)
    for scale in (1.0, 3.0, 0.3):
        for _ in range(10):
            terms = random.normal(size=crests.TERMS) * scale**powers
            turns = np.roots((terms * powers)[:0:-1])
            turns = turns.real[(abs(turns.imag) < 1e-9) & (turns.real > 0) & (turns.real < 1)]
            places = np.concatenate([[0.0, 1.0], turns])
            best = float((terms @ places**powers[:, None]).max())
            known = 0.0 if best > 0 else 2 * abs(best)
            for floor, found in ((known, best > 0), (abs(best) * (1 + 1e-9), False)):
                room[crests.FIRST, :crests.TERMS] = terms
                crests.bernstein.py_func(room[crests.FIRST])
                at = crests.highest.py_func(floor, room)
                assert (at >= 0) == found
                if found:
                    assert terms @ at**powers == pytest.approx(best, rel=3e-11)


def test_always_round_off_alone_ends():
    room = np.zeros((crests.ROWS, crests.TERMS + 2))
    room[crests.FIRST, :crests.TERMS] = np.random.default_rng(4).normal(size=crests.TERMS) * 1e-300
    assert 0 <= crests.highest.py_func(0.0, room) <= 1
    room[crests.FIRST, :crests.TERMS] = 0.0
    assert crests.highest.py_func(0.0, room) < 0
