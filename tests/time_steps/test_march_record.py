"""Record of a march: cycles that repeat are not computed again, early samples may be left out, copies go on."""

import numpy as np
import pytest
from march_contacts import (
    make_bond_contact,
    make_contact,
    make_coulomb,
    make_pressed_contact,
    make_tanh,
)
from march_paths import OMEGA
from modal_bases import make_modal_basis
from varying_load_cases import LAWS, MIXED, crowned_contact, make_modes

from patchfem.core import Outcome, SineDrive
from patchfem.friction import BondGrowth, Bonds
from patchfem.partial_slip.shear_modes import shear_modes
from patchfem.structure import drive_sizes
from patchfem.time_steps import March, laws, march
from patchfem.time_steps import time_march as engine
from patchfem.time_steps.contacts import Press

from .test_march_loads import reduce_to_shear_modes

DRIVE = SineDrive(49.0, OMEGA)
BASIS = make_modal_basis(OMEGA, 0.05)
ROW = np.ones(1)
PITCHES = make_modes([143.0], [1.0], [0.0], [20.0], 0.05)
CYCLES = 400
STEPS = 80


def make_tanh_contact(rows=ROW[None]):
    """Return the contact of 20 N tanh(v/(5 mm/s))."""
    return make_contact([make_tanh(20.0, 5e-3)], rows)


def make_compliance(count, scale=1.0):
    """Return a tangential compliance (m, m) with the logarithm of a half-plane, and the positions (m,)."""
    x = (np.arange(count) + 0.5) / count - 0.5
    gap = np.abs(x[:, None] - x)
    return scale * np.log(2.5 / np.where(gap > 0, gap, 0.3 / count)), x


def make_compliant_contact():
    """Return bonds behind shear modes."""
    compliance, x = make_compliance(12, 1e-7)
    force = 60.0 * (1 + 0.8 * x) / 12
    modes = shear_modes(compliance, 0.4 * force, 12)
    return make_bond_contact(Bonds(0.4, 1e-6), force, ROW, modes)


def make_pitching_contact(basis):
    """Return elastic-plastic points under a pressure that changes with the motion."""
    sets = crowned_contact()
    return make_pressed_contact(
        LAWS["plastic"],
        sets.force,
        basis.slide,
        reduce_to_shear_modes(sets, 4),
        press=Press(sets, basis.normal, basis.pitch),
    )


CASES = {
    "tanh": lambda: (BASIS, make_tanh_contact()),
    "coulomb": lambda: (BASIS, make_contact([make_coulomb(20.0, 16.0)], ROW[None])),
    "elements": lambda: (
        BASIS,
        make_contact([laws.make_elements([2e7, 1e7, 4e6], [3e-7, 1e-6, 2e-6])], [ROW]),
    ),
    "bonds": lambda: (BASIS, make_bond_contact(Bonds(0.4, 1e-6), 50.0, ROW)),
    "bonds behind shear modes": lambda: (BASIS, make_compliant_contact()),
    "a changing load": lambda: (PITCHES, make_pitching_contact(PITCHES)),
}


def count_steps(monkeypatch) -> list:
    """Return a list to which every part of a march appends its number of steps."""
    steps = []
    advance = March.advance
    monkeypatch.setattr(
        March, "advance", lambda run, count: steps.append(count) or advance(run, count)
    )
    return steps


@pytest.mark.parametrize("case", CASES)
def test_exact_repeated_cycles_agree_with_complete_march(case, monkeypatch):
    """Histories, extremes, phasors and energies of a march that repeats cycles agree with a complete march."""
    basis, contact = CASES[case]()
    steps = count_steps(monkeypatch)
    short, complete = (
        march(basis, DRIVE, contact, CYCLES, STEPS, window=5, frames=3, repeats=repeats)
        for repeats in (True, False)
    )
    assert sum(steps) < 1.8 * CYCLES * STEPS
    for name in ("time", "modal", "modal_rate", "slide", "force", "slip", "acceleration"):
        for part in ("window", "response"):
            found = getattr(getattr(short, part), name)
            expected = getattr(getattr(complete, part), name)
            assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max(), name
    assert short.extremes == pytest.approx(complete.extremes, rel=1e-8)
    assert np.abs(short.phasors - complete.phasors).max() <= 1e-8 * np.abs(complete.phasors).max()
    for name in ("work_in", "viscous", "friction", "booked", "sampled", "passed"):
        assert short.ledger[name] == pytest.approx(complete.ledger[name], rel=1e-8), name
    ends = short.response.extra["ledger"][:, -1], complete.response.extra["ledger"][:, -1]
    assert ends[0] == pytest.approx(ends[1], rel=1e-7, abs=1e-12 * complete.ledger["power"])
    assert short.cycles_done == complete.cycles_done == CYCLES
    assert len(short.snapshots) == len(complete.snapshots) == 3


def test_exact_beats_and_slow_growth_are_not_repeated(monkeypatch):
    """All steps are computed if an undamped mode beats, or if bonds grow over a time much longer than the run."""
    ones = np.ones(2)
    beating = make_modal_basis(OMEGA * np.array([1.0, 1.37]), [0.05, 0.0], [1.0, 0.0], ones, ones)
    growing = Bonds(0.4, 1e-6, ratio=2.0, growth=BondGrowth(1e-12, 1e3))
    steps = count_steps(monkeypatch)
    march(beating, DRIVE, make_tanh_contact(beating.interfaces), CYCLES, STEPS, window=5)
    march(BASIS, DRIVE, make_bond_contact(growing, 50.0, ROW), CYCLES, STEPS, window=5)
    assert sum(steps) == 2 * CYCLES * STEPS


@pytest.mark.parametrize("cycles, travel", [(40.3, np.inf), (40, 0.8)])
def test_exact_last_cycles_are_the_same_without_histories(cycles, travel):
    """A march that keeps no early samples has the same last cycles, amplitudes and energies, also if it ends early."""
    contact = make_contact([laws.make_elements([2e5, 1e5], [1e-6, 2e-6])], [ROW])
    basis = make_modal_basis(OMEGA, 0.003)
    if np.isfinite(travel):
        travel *= march(basis, DRIVE, contact, cycles, 40, window=2).extremes.max()
    complete, short = (
        march(basis, DRIVE, contact, cycles, 40, window=2, travel=travel, keeps_samples=keep)
        for keep in (True, False)
    )
    outcome = Outcome.EXCEEDS_TRAVEL if np.isfinite(travel) else None
    assert complete.outcome is short.outcome is outcome
    assert complete.cycles_done == short.cycles_done
    for name in ("time", "slide", "force", "output", "acceleration"):
        assert np.array_equal(getattr(complete.window, name), getattr(short.window, name))
    assert np.array_equal(complete.step_force, short.step_force)
    assert np.array_equal(complete.extremes, short.extremes)
    assert short.ledger == complete.ledger and short.window_work == complete.window_work


def test_exact_copy_of_march_goes_on_like_the_original():
    """A copy goes on with the same samples after the original has gone on."""
    run = March(MIXED, DRIVE, make_pitching_contact(MIXED), 200)
    run.advance(200)
    copy = run.fork()
    first = run.advance(200)
    second = copy.advance(200)
    assert np.abs(first - second).max() <= 1e-13 * np.abs(first).max() and np.ptp(first[:, 0]) > 0


def test_exact_parts_of_a_march_do_not_matter(monkeypatch):
    """A march in single cycles equals one in parts of eight cycles to the last bit."""
    runs = []
    for most in (1, 8):
        monkeypatch.setattr(engine, "MAX_CYCLES_AT_ONCE", most)
        runs.append(march(BASIS, DRIVE, make_compliant_contact(), 33, STEPS, repeats=False))
    assert np.array_equal(runs[0].window.slide, runs[1].window.slide)
    assert np.array_equal(runs[0].extremes, runs[1].extremes)


def test_exact_long_march_keeps_thinned_samples_of_all_cycles(monkeypatch):
    """Of more early samples than there is room for, those at larger distances are kept: every cycle has some.

    Once the samples ended where the room was full, with a gap up to the last cycles.
    """
    whole = march(BASIS, DRIVE, make_tanh_contact(), 40, STEPS, repeats=False).response
    monkeypatch.setattr(drive_sizes, "MAX_EARLY_SAMPLES", 300)
    thinned = march(BASIS, DRIVE, make_tanh_contact(), 40, STEPS, repeats=False).response
    assert len(thinned.time) <= 300 + 18 * STEPS < len(whole.time)
    assert np.diff(thinned.time).max() < 0.3 * DRIVE.period
    places = np.searchsorted(whole.time, thinned.time)
    assert np.array_equal(thinned.slide, whole.slide[places])
