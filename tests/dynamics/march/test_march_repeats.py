"""Extrapolation of a march that has become periodic, against a march of all cycles."""

import numpy as np
import pytest
from march_paths import ALL, OMEGA, make_one_mode, make_tanh_model
from modal_bases import make_modal_basis
from test_joints import coulomb_joint, elastic_plastic_joint, make_chain
from test_march_loop import half_plane_compliance
from test_varying_shear import reduce_to_shear_modes
from varying_load_cases import LAWS, crowned_contact, make_modes

from patchfem.core import SineDrive
from patchfem.dynamics import JointsModel, coulomb_model, jenkins_model, points_model
from patchfem.dynamics.march import march as marching
from patchfem.dynamics.march import run as marching_run
from patchfem.dynamics.march import varying_load
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds
from patchfem.slip.shear_modes import shear_modes

PITCHES = make_modes([143.0], [1.0], [0.0], [20.0], 0.05)
DRIVE, BASIS, CYCLES, STEPS = SineDrive(49.0, OMEGA), make_one_mode(OMEGA, 0.05, 1.0), 400, 80


def compliant_points_model():
    """Return a model of bonds behind shear modes."""
    law, (compliance, x) = Bonds(0.4, 1e-6), half_plane_compliance(12, 1e-7)
    area = np.full(12, 1 / 12)
    sigma = 60.0 * (1 + 0.8 * x)
    return points_model(
        law, area, sigma, shear_modes(compliance, law.static * area * sigma, law.length, 12)
    )


def two_mass_joints(*joints):
    """Return a chain of two masses and the model of its joints."""
    basis = make_chain([OMEGA**2, 2 * OMEGA**2], zeta=0.05)
    return basis, JointsModel(None, joints, basis.interfaces, 20.0, ALL)


CASES = {
    "tanh": lambda: (BASIS, make_tanh_model(20.0, 5e-3)),
    "coulomb": lambda: (BASIS, coulomb_model(20.0, 16.0)),
    "elements": lambda: (BASIS, jenkins_model([2e7, 1e7, 4e6], [3e-7, 1e-6, 2e-6])),
    "bonds": lambda: (BASIS, points_model(Bonds(0.4, 1e-6), [1e-4], [50e4])),
    "bonds behind shear modes": lambda: (BASIS, compliant_points_model()),
    "two faces": lambda: two_mass_joints(
        coulomb_joint(0, 12.0, 10.0), elastic_plastic_joint(1, 8.0, 1e-6)
    ),
    "a changing load": lambda: (
        PITCHES,
        varying_load.make_model(
            PITCHES,
            LAWS["plastic"],
            crowned_contact(),
            None,
            reduce_to_shear_modes(crowned_contact(), LAWS["plastic"], 4),
        ),
    ),
}


def march_and_count(case: str, monkeypatch, extrapolates: bool, **options):
    """Return the result of a march and the fraction of its steps that were computed."""
    basis, model = CASES[case]()
    steps = []
    march_rows = marching.Run._march_rows
    monkeypatch.setattr(marching_run, "PERIODIC_TOL", 1e-12 if extrapolates else -1.0)
    monkeypatch.setattr(
        marching.Run,
        "_march_rows",
        lambda run, size, *arguments: steps.append(size) or march_rows(run, size, *arguments),
    )
    result = march(basis, DRIVE, model, CYCLES, STEPS, 5, **options)
    monkeypatch.undo()
    return result, sum(steps) / (CYCLES * STEPS)


def assert_close(found, expected, tolerance: float) -> None:
    """Assert that two arrays agree within a tolerance of the largest value."""
    assert np.abs(found - expected).max(initial=0.0) <= tolerance * np.abs(expected).max(
        initial=0.0
    )


@pytest.mark.share(0, 3, 4, 7, 8, 10)
@pytest.mark.parametrize("keeps_samples", [True, False])
@pytest.mark.parametrize(
    "case", [*list(CASES)[:-1], pytest.param("a changing load", marks=pytest.mark.slow)]
)
def test_exact_extrapolated_cycles_agree_with_complete_march(case, keeps_samples, monkeypatch):
    """Histories, extremes, phasors, energies and fields of a march that omits periodic cycles agree
    with a complete march within 1e-10."""
    extrapolated, fraction = march_and_count(
        case,
        monkeypatch,
        True,
        keeps_samples=keeps_samples,
        frames=3,
        marks=(60, CYCLES) if keeps_samples else (),
    )
    complete, complete_fraction = march_and_count(
        case,
        monkeypatch,
        False,
        keeps_samples=keeps_samples,
        frames=3,
        marks=(60, CYCLES) if keeps_samples else (),
    )
    assert fraction < 0.75 and complete_fraction == 1.0
    for name in ("time", "modal", "modal_rate", "slide", "force", "slip", "acceleration"):
        assert_close(getattr(extrapolated.window, name), getattr(complete.window, name), 1e-10)
        assert_close(getattr(extrapolated.response, name), getattr(complete.response, name), 1e-10)
    for found, expected in zip(
        extrapolated.response.extra["ledger"], complete.response.extra["ledger"]
    ):
        assert_close(found, expected, 1e-10)
    assert_close(extrapolated.extremes, complete.extremes, 1e-10)
    assert_close(extrapolated.phasors, complete.phasors, 1e-10)
    assert_close(extrapolated.step_force, complete.step_force, 1e-10)
    assert extrapolated.window_work == pytest.approx(complete.window_work, rel=1e-10)
    energies = {name: value for name, value in complete.ledger.items() if "iterations" not in name}
    assert {name: extrapolated.ledger[name] for name in energies} == pytest.approx(
        energies, rel=1e-10
    )
    for found, expected in zip(extrapolated.snapshots, complete.snapshots):
        for name in expected:
            assert_close(np.asarray(found[name]), np.asarray(expected[name]), 1e-10)
    for found, expected in zip(extrapolated.marks, complete.marks):
        assert_close(found.window.slide, expected.window.slide, 1e-10)
        assert found.ledger["work_in"] == pytest.approx(expected.ledger["work_in"], rel=1e-10)
    assert (
        extrapolated.cycles_done == complete.cycles_done
        and len(extrapolated.snapshots) == len(complete.snapshots) == 3
    )


def test_exact_beats_and_slow_growth_are_not_extrapolated(monkeypatch):
    """All steps are computed if an undamped mode beats, or if bonds grow over a time much longer
    than the run."""
    ones = np.ones(2)
    beating_modes = make_modal_basis(
        OMEGA * np.array([1.0, 1.37]), [0.05, 0.0], [1.0, 0.0], ones, ones
    )
    growing_bonds = points_model(
        Bonds(0.4, 1e-6, ratio=2.0, rest_growth=1e-12, slip_growth=1e3), [1e-4], [50e4]
    )
    for name, case in (
        ("beat", (beating_modes, make_tanh_model(20.0, 5e-3))),
        ("growth", (BASIS, growing_bonds)),
    ):
        monkeypatch.setitem(CASES, name, lambda case=case: case)
        assert march_and_count(name, monkeypatch, True)[1] == 1.0, name


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
def test_always_only_decaying_motion_counts_as_periodic(motion, periodic, monkeypatch):
    """A state that decays or stays counts as periodic; a state that creeps, beats, decays slowly or
    has another period does not. The states follow formulas over 1024 cycles."""
    run = marching.start_run(BASIS, DRIVE, make_tanh_model(20.0, 5e-3), STEPS)
    monkeypatch.setattr(
        run, "_carried_state", lambda: [np.array([1.0 + motion(run.done // STEPS), 1.0])]
    )
    run.checked_states = np.zeros((3, 2))
    is_found = False
    for number in range(1, 1025):
        run.done = number * STEPS
        is_found = is_found or run.is_periodic(100_000)
    assert is_found == periodic
