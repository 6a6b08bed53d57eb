"""A march that has become periodic leaves the rest of its cycles out: all numbers are those of all cycles marched."""

from time import process_time

import numpy as np
import pytest
from march_paths import ALL, OMEGA, one_mode, rate_model
from modal_bases import basis_of
from test_joints import chain, coulomb, elastic_plastic
from test_march_loop import half_plane
from test_varying_shear import reduced
from varying_load_cases import LAWS, crowned, modes

from patchfem.core import SineDrive
from patchfem.dynamics import JointsModel, coulomb_model, jenkins_model, points_model
from patchfem.dynamics.march import march as marching
from patchfem.dynamics.march import run as marching_run
from patchfem.dynamics.march import varying_load
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds
from patchfem.slip.shear_modes import shear_modes

PITCHES = modes([143.0], [1.0], [0.0], [20.0], 0.05)
DRIVE, BASIS, CYCLES, STEPS = SineDrive(49.0, OMEGA), one_mode(OMEGA, 0.05, 1.0), 400, 80


def sheared():
    law, (compliance, x) = Bonds(0.4, 1e-6), half_plane(12, 1e-7)
    area = np.full(12, 1 / 12)
    sigma = 60.0 * (1 + 0.8 * x)
    return points_model(
        law, area, sigma, shear_modes(compliance, law.static * area * sigma, law.length, 12)
    )


def pair(*joints):
    basis = chain([OMEGA**2, 2 * OMEGA**2], zeta=0.05)
    return basis, JointsModel(None, joints, basis.interfaces, 20.0, ALL)


CASES = {
    "tanh": lambda: (BASIS, rate_model(20.0, 5e-3)),
    "coulomb": lambda: (BASIS, coulomb_model(20.0, 16.0)),
    "elements": lambda: (BASIS, jenkins_model([2e7, 1e7, 4e6], [3e-7, 1e-6, 2e-6])),
    "bonds": lambda: (BASIS, points_model(Bonds(0.4, 1e-6), [1e-4], [50e4])),
    "bonds behind shear modes": lambda: (BASIS, sheared()),
    "two faces": lambda: pair(coulomb(0, 12.0, 10.0), elastic_plastic(1, 8.0, 1e-6)),
    "a changing load": lambda: (
        PITCHES,
        varying_load.make_model(
            PITCHES, LAWS["plastic"], crowned(), None, reduced(crowned(), LAWS["plastic"], 4)
        ),
    ),
}


def marched(case: str, monkeypatch, repeats: bool, **more):
    """(result, share of the steps that were marched)."""
    basis, model = CASES[case]()
    steps = []
    moved = marching.Run._march_rows
    monkeypatch.setattr(marching_run, "PERIODIC_TOL", 1e-12 if repeats else -1.0)
    monkeypatch.setattr(
        marching.Run,
        "_march_rows",
        lambda run, size, *rest: steps.append(size) or moved(run, size, *rest),
    )
    done = march(basis, DRIVE, model, CYCLES, STEPS, 5, **more)
    monkeypatch.undo()
    return done, sum(steps) / (CYCLES * STEPS)


def alike(one, other, within: float) -> None:
    assert np.abs(one - other).max(initial=0.0) <= within * np.abs(other).max(initial=0.0)


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize(
    "case", [*list(CASES)[:-1], pytest.param("a changing load", marks=pytest.mark.slow)]
)
def test_exact_cycles_that_are_left_out_are_as_the_last_one(case, whole, monkeypatch):
    """Histories, extremes, phasors, sums, works and fields."""
    left, share = marched(
        case, monkeypatch, True, keeps_samples=whole, frames=3, marks=(60, CYCLES) if whole else ()
    )
    every, all_of_it = marched(
        case, monkeypatch, False, keeps_samples=whole, frames=3, marks=(60, CYCLES) if whole else ()
    )
    assert share < 0.75 and all_of_it == 1.0
    for name in ("time", "modal", "modal_rate", "slide", "force", "slip", "acceleration"):
        alike(getattr(left.window, name), getattr(every.window, name), 1e-10)
        alike(getattr(left.response, name), getattr(every.response, name), 1e-10)
    for one, other in zip(left.response.extra["ledger"], every.response.extra["ledger"]):
        alike(one, other, 1e-10)
    alike(left.amplitudes, every.amplitudes, 1e-10)
    alike(left.phasors, every.phasors, 1e-10)
    alike(left.step_force, every.step_force, 1e-10)
    assert left.window_work == pytest.approx(every.window_work, rel=1e-10)
    book = {name: value for name, value in every.ledger.items() if "iterations" not in name}
    assert {name: left.ledger[name] for name in book} == pytest.approx(book, rel=1e-10)
    for one, other in zip(left.snapshots, every.snapshots):
        for name in other:
            alike(np.asarray(one[name]), np.asarray(other[name]), 1e-10)
    for one, other in zip(left.marks, every.marks):
        alike(one.window.slide, other.window.slide, 1e-10)
        assert one.ledger["work_in"] == pytest.approx(other.ledger["work_in"], rel=1e-10)
    assert (
        left.cycles_done == every.cycles_done and len(left.snapshots) == len(every.snapshots) == 3
    )


def test_always_a_hundred_times_the_cycles_cost_little_more():
    (basis, model), seconds = CASES["bonds"](), {}
    for cycles in (200, 20_000):
        begin = process_time()
        done = march(basis, DRIVE, model, cycles, STEPS, 5, keeps_samples=False)
        seconds[cycles] = process_time() - begin
        assert done.cycles_done == cycles
    assert seconds[20_000] < 3 * seconds[200]


def test_exact_a_mode_that_beats_and_bonds_that_grow_are_marched_to_the_end(monkeypatch):
    """A mode without damping beside the friction, and bonds that grow over far more than the run."""
    ones = np.ones(2)
    beats = basis_of(OMEGA * np.array([1.0, 1.37]), [0.05, 0.0], [1.0, 0.0], ones, ones)
    grows = points_model(
        Bonds(0.4, 1e-6, ratio=2.0, rest_growth=1e-12, slip_growth=1e3), [1e-4], [50e4]
    )
    for name, case in (("beat", (beats, rate_model(20.0, 5e-3))), ("growth", (BASIS, grows))):
        monkeypatch.setitem(CASES, name, lambda case=case: case)
        assert marched(name, monkeypatch, True)[1] == 1.0, name


@pytest.mark.parametrize(
    "motion, periodic",
    [
        (lambda k: 0.5**k, True),
        (lambda k: 0.0, True),
        (lambda k: 3e-16 * np.sin(k * k), True),
        (lambda k: 1e-14 * k, False),
        (lambda k: 1e-6 * (-1) ** k, False),
        (lambda k: 1e-6 * np.sin(1 + 2 * np.pi * k / 3), False),
        (lambda k: 1e-6 * np.cos(0.1 * k), False),
        (lambda k: 0.99**k, False),
    ],
    ids=[
        "dies out",
        "stays",
        "round-off",
        "creep",
        "period two",
        "period three",
        "beat",
        "slow decay",
    ],
)
def test_always_what_creeps_beats_or_has_another_period_does_not_repeat(
    motion, periodic, monkeypatch
):
    """Of a state that goes as a formula over 1024 cycles with 1e5 to come."""
    run = marching.start_run(BASIS, DRIVE, rate_model(20.0, 5e-3), STEPS)
    monkeypatch.setattr(
        run, "_carried_state", lambda: [np.array([1.0 + motion(run.done // STEPS), 1.0])]
    )
    run.looks = np.zeros((3, 2))
    found = False
    for number in range(1, 1025):
        run.done = number * STEPS
        found = found or run.is_periodic(100_000)
    assert found == periodic
