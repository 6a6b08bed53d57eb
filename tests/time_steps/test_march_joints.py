"""Several interfaces, nonlinear springs and rigid friction in one march: closed forms, the motion from event to event."""

import numpy as np
import problems
import pytest
from hypothesis import given
from hypothesis import strategies as st
from march_contacts import (
    make_contact,
    make_coulomb,
    make_cubic_spring,
    make_interlocking_spring,
    make_tanh,
)
from modal_bases import make_modal_basis
from scipy.special import ellipk

from patchfem.core import InitialState, ModalBasis, SineDrive
from patchfem.friction import Bonds
from patchfem.motion_measures import energy_balance
from patchfem.structure import make_release
from patchfem.time_steps import laws, march

EVENT_ERROR = 1e-6  # an event is located within 1/2048 of a step


def make_chain(stiffness, zeta=0.0, faces=None):
    """Return the modes of unit masses in a row.

    Spring i connects mass i to the mass before it, spring 0 to the base; the last mass has a free end.
    """
    n = len(stiffness)
    k = np.zeros((n, n))
    for i, s in enumerate(stiffness):
        k[i, i] += s
        if i:
            k[i - 1, i - 1] += s
            k[i - 1, i] -= s
            k[i, i - 1] -= s
    square, shape = np.linalg.eigh(k)
    faces = np.eye(n) if faces is None else np.asarray(faces, float)
    rows = faces @ shape
    return ModalBasis(
        tuple(map(str, range(n))),
        np.sqrt(np.maximum(square, 0.0)),
        np.full(n, zeta),
        rows[0],
        shape.T @ np.ones(n),
        shape[0],
        1.0,
        None,
        rows,
        shapes=shape,
    )


@pytest.mark.parametrize(
    "spring, period",
    [
        (make_cubic_spring(1.0, np.ones(1)), 4 * ellipk(0.5)),
        (make_interlocking_spring(1.0, 2 * np.pi, np.ones(1)), 4 * ellipk(np.sin(0.5) ** 2)),
    ],
    ids=["duffing", "pendulum"],
)
def test_exact_nonlinear_springs_conserve_energy_and_period(spring, period):
    """A cubic spring and a pendulum conserve their energy within 1e-9; the period converges with order two."""
    start = InitialState(np.array([1.0]), np.zeros(1))
    modes = make_modal_basis(0.0, 0.0)
    errors = []
    for steps in (20, 100, 500):
        contact = make_contact([], np.zeros((0, 1)), [spring], 1.0)
        result = march(modes, make_release(2 * np.pi), contact, 30, steps, window=30, start=start)
        assert result.outcome is None
        assert result.ledger["work_in"] == pytest.approx(result.ledger["stored"], rel=1e-9)
        r = result.response
        crossings = np.flatnonzero((r.slide[:-1] > 0) & (r.slide[1:] <= 0))
        parts = np.diff(r.time)[crossings] / np.diff(r.slide)[crossings]
        times = r.time[crossings] - r.slide[crossings] * parts
        errors.append(abs(np.diff(times).mean() / period - 1))
        assert errors[-1] < 5 / steps**2
    assert np.log(errors[0] / errors[2]) / np.log(25) == pytest.approx(2.0, abs=0.1)


def march_random_chain(seed):
    """Return the march of a random chain of 2 to 4 masses with mixed laws and springs, and the friction limits."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    faces = np.eye(n) if rng.random() < 0.5 else np.eye(n) - np.eye(n, k=-1)
    modes = make_chain(
        rng.uniform(0.0, 5.0, n) * (rng.random(n) > 0.2), zeta=rng.uniform(0, 0.1), faces=faces
    )
    limit = rng.uniform(0.05, 2.0, n)
    length = 10 ** rng.uniform(-3, 0, n)
    kinds = [rng.choice(["coulomb", "ep", "bonds", "tanh"]) for _ in range(n)]
    kinetic = limit * rng.choice([0.3, 1.0], n)
    makers = {
        "coulomb": lambda p: make_coulomb(limit[p], kinetic[p]),
        "ep": lambda p: laws.make_cells(limit[p], length[p], 1.0),
        "bonds": lambda p: laws.make_bonds(Bonds(0.5, length[p]), 2 * limit[p]),
        "tanh": lambda p: make_tanh(limit[p], length[p]),
    }
    point_laws = [makers[kind](p) for p, kind in enumerate(kinds)]
    springs = [
        make_cubic_spring(rng.uniform(0, 3), modes.interfaces[0]),
        make_interlocking_spring(rng.uniform(0, 3), rng.uniform(0.5, 5), modes.interfaces[-1]),
    ]
    drive = SineDrive(1.0, rng.uniform(0.3, 3.0))
    contact = make_contact(point_laws, modes.interfaces, springs)
    return march(modes, drive, contact, 5, int(rng.integers(20, 120))), limit


@given(st.integers(0, 10_000))
def test_always_random_chains_balance_energy(seed):
    """For random chains every step has a solution, the energy is balanced, and no force exceeds its limit."""
    result, limit = march_random_chain(seed)
    assert result.outcome is None
    assert energy_balance(result.ledger) <= 1e-9
    forces = np.abs(result.response.extra["forces"]).max(axis=0)
    assert np.all(forces <= limit * (1 + 1e-9))


# Seeds with kinetic below static friction, and with steep laws, in which a step is difficult to solve.
@pytest.mark.parametrize("seed", [134, 242, 514, 667, 744, 960, 1025, 2651, 4822])
def test_always_difficult_random_chains_converge(seed):
    """Random chains converge although the states of stick and slip in one of their steps are difficult to find."""
    assert march_random_chain(seed)[0].outcome is None


# ---- stops and releases inside steps


def test_always_march_with_too_many_stops_ends():
    """A rigid point that stops thousands of times within a step has no result, and the march ends with a message."""
    result = march(
        make_modal_basis(1e7, 0.0),
        SineDrive(0.0, 1e3),
        make_contact([make_coulomb(1e-3, 5e-4)], np.ones((1, 1))),
        1,
        4,
        start=InitialState([1e-6], [0.0]),
    )
    assert result.outcome == "not_converged" and "too often" in result.message


def find_errors(modes, drive, static, kinetic, cycles):
    """Return the largest relative error of the extremes of all cycles for 400, 1600 and 6400 steps.

    The reference is the motion from event to event; several limits belong to several interfaces.
    """
    pairs = list(zip(np.atleast_1d(static), np.atleast_1d(kinetic)))
    reference = problems.run_motion(
        modes, drive, [problems.make_coulomb(*pair) for pair in pairs], cycles, window=cycles
    )
    point_laws = [make_coulomb(sticks, slides) for sticks, slides in pairs]
    contact = make_contact(point_laws, modes.interfaces)
    errors = []
    for count in (400, 1600, 6400):
        result = march(modes, drive, contact, cycles, count, window=cycles)
        assert result.outcome is None and energy_balance(result.ledger) < 1e-9
        size = np.abs(reference.extremes).max()
        errors.append(np.abs(result.extremes - reference.extremes).max() / size)
    return np.array(errors)


@pytest.mark.share(1)
@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.2])
def test_order_with_kinetic_below_static_friction(ratio):
    """Amplitudes converge if the kinetic friction is below the static friction."""
    modes = make_modal_basis(1.0, 0.02, [1.0], [-1.0])
    errors = find_errors(modes, SineDrive(1.0, 0.3, False), 0.8, 0.8 * ratio, 20)
    assert errors[0] < 1e-4 and np.all(errors[1:] < np.maximum(errors[:-1] / 3, EVENT_ERROR))


@pytest.mark.parametrize(
    "seed, n_interfaces, n_modes, coupled", [(3, 2, 3, False), (1, 3, 3, True)]
)
def test_order_for_coupled_stops_with_kinetic_below_static(seed, n_interfaces, n_modes, coupled):
    """Coupled interfaces with stops and releases converge to the motion from event to event."""
    rng = np.random.default_rng(seed)
    rows = rng.uniform(-1, 1, (n_interfaces, n_modes))
    root = rng.normal(size=(n_modes, n_modes))
    limit = rng.uniform(0.1, 0.5, n_interfaces)
    basis = make_modal_basis(
        np.sort(rng.uniform(0.5, 4.0, n_modes)),
        0.02,
        rows,
        rng.uniform(-1, 1, n_modes),
        damping=0.05 * root @ root.T if coupled else None,
    )
    errors = find_errors(basis, SineDrive(1.0, 0.8), limit, 0.4 * limit, 5)
    assert errors[0] < 1e-3 and np.all(errors[1:] < np.maximum(errors[:-1] / 3, EVENT_ERROR))
