"""Pieces that give way in shear under a contact whose load and set change: a dense march, limits, energy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import root
from varying_load_cases import (
    LAWS,
    LOAD,
    MASS,
    MIXED,
    balance,
    check_energy_of_random_march,
    check_order_two,
    crowned,
    march_with_lift_off,
    modes,
)

from patchfem.contact.unilateral import solve_forces
from patchfem.core import InitialState, PatchfemError, SineDrive
from patchfem.dynamics.march import march as plain
from patchfem.dynamics.march import models, varying_load
from patchfem.dynamics.propagator import make_propagator
from patchfem.friction import Bonds, FirstOrderBonds
from patchfem.friction.bonds.recursion import advance_bonds
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.slip import jenkins_set
from patchfem.slip.shear_modes import shear_modes

SOFT = {"plastic": ElasticPlastic(0.3, 1e-6), "bonds": FirstOrderBonds(Bonds(0.3, 1e-6))}


def giving(x, depth: float = 3e-8) -> np.ndarray:
    """A tangential compliance [m/N] like that of pieces with a skin."""
    return depth * (0.5 * np.exp(-np.abs(x[:, None] - x) / 2e-3) + 0.3 * np.eye(x.size))


def reduced(sets, law, count=None, depth: float = 3e-8, tolerance: float = 1e-3):
    """Shear modes on the nodes of contact sets, as many as there are nodes where no count is given."""
    force = sets.reference.forces(0.0, 0.0)
    count = sets.x.size if count is None else count
    return varying_load.choose_shear_modes(
        giving(sets.x, depth), law, force, np.ones(force.size), count or None, tolerance
    )


def dense(basis, drive, law, sets, response, steps: int) -> tuple:
    """Slides, friction forces and energy lost by a march on the nodes themselves: displacements u (m,) of the pieces
    behind the stiffness C^-1, bench laws, a general root finder; the nodal forces from heave and turn of a run."""
    p = make_propagator(basis, drive, steps)
    table = p.tables(drive, 0, steps)
    beta = p.beta[0, 0]
    stiff = np.linalg.inv(giving(sets.x))
    motion = zip(-response.extra["heave"], response.extra["turn"])
    loads = np.array(
        [
            solve_forces(sets.c, sets.x, sets.opening - d + t * sets.x, np.zeros(0))[0]
            for d, t in motion
        ]
    )
    z = v = 0.0
    u = np.zeros(sets.x.size)
    state = law.start(loads[0])
    slides = [0.0]
    forces = [0.0]
    bonds = isinstance(law, FirstOrderBonds)

    def moved(state, xi, load):
        """(mean tractions, state) after the slides xi (m,)."""
        if not bonds:
            step = law.step(state, xi, load, load, p.dt)
            return step.mean, step.state
        out, mean, _, _ = advance_bonds(state.bonds, xi, load, 1e-6)
        kept = np.where(load > 0, out, state.bonds)
        return 0.3 / 1e-6 * np.where(load > 0, mean, 0.0), state._replace(bonds=kept)

    for i in range(len(loads) - 1):
        middle = (loads[i] + loads[i + 1]) / 2
        ready = law.press(state, loads[i], middle).state
        row = table[i % steps]
        rest = (
            p.free[0, 0] * z + p.free[1, 0] * v + row[0],
            p.free[2, 0] * z + p.free[3, 0] * v + row[1],
        )

        def miss(y, ready=ready, middle=middle, free=rest[0] - z, u=u):
            mean = moved(ready, 1e-6 * (y[0] - y[1:]), middle)[0]
            return np.append(
                (1e-6 * y[0] - free) / beta + mean.sum(), stiff @ (u + 0.5e-6 * y[1:]) - mean
            )

        y = 1e-6 * root(miss, np.zeros(u.size + 1), tol=1e-14).x
        state = law.press(moved(ready, y[0] - y[1:], middle)[1], middle, loads[i + 1]).state
        u = u + y[1:]

        def away(y, state=state, load=loads[i + 1], u=u):
            return stiff @ (u + 1e-6 * y) - law.traction(moved(state, -1e-6 * y, load)[1])

        y_back = 1e-6 * root(away, np.zeros(u.size), tol=1e-14).x
        state = moved(state, -y_back, loads[i + 1])[1]
        u = u + y_back
        accel = -(rest[0] - z - y[0]) / beta / MASS
        z = rest[0] + p.push[0, 0] * accel
        v = rest[1] + p.push[1, 0] * accel
        slides.append(z)
        forces.append(law.traction(state).sum())
    return np.array(slides), np.array(forces), loads


@pytest.mark.parametrize("name", ["plastic", "bonds"])
def test_exact_all_modes_are_the_nodes_themselves(name):
    """Every mode kept, sets that open and close: the march of the nodes behind the dense compliance."""
    basis = modes([143.0, 300.0, 410.0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 250.0], 0.01, [1.0, 0, 0])
    drive = SineDrive(120.0, 2 * np.pi * 143)
    sets = crowned()
    law = LAWS[name]
    steps = 60
    done = varying_load.march(
        basis,
        drive,
        sets,
        law,
        1,
        steps,
        1,
        start=InitialState([0, 5e-7, 5e-7], [0, 0, 0]),
        shear=reduced(sets, law),
    )
    single = modes([143.0], [1.0], [0.0], [0.0], 0.01)
    slides, forces, loads = dense(single, drive, SOFT[name], sets, done.response, steps)
    r = done.response
    touching = (loads > 0).sum(axis=1)
    assert touching.min() < 10 and touching.max() == 21 and np.abs(r.force).max() > 0.9 * 0.3 * LOAD
    assert r.slide == pytest.approx(slides, abs=1e-8 * np.abs(slides).max())
    assert r.force == pytest.approx(forces, abs=1e-7 * 0.3 * LOAD)
    assert done.outcome is None and balance(done, basis) <= 1e-11


@pytest.mark.share(1)
@pytest.mark.parametrize("name", ["plastic", "bonds", "growing"])
def test_exact_a_still_load_is_the_march_on_the_preload(name):
    """normal = 1e-9: bonds as by shear modes of the preloaded set, elastic-plastic as by its exact parallel elements.
    The two differ by what springs back, which falls with the square of the step, to 3e-8 at 3200 steps a cycle."""
    basis = modes([143.0, 700.0], [1.0, 0.3], [1e-9, 0.0], [0.0, 0.0], 0.01)
    drive = SineDrive(40.0, 2 * np.pi * 300)
    sets = crowned()
    law = LAWS[name]
    force = sets.reference.forces(0.0, 0.0)
    soft = giving(crowned().x)
    if name == "plastic":
        group = jenkins_set(soft, 0.3 * force, 1e-6)
        model = models.jenkins_model(group.stiffness, group.yield_displacement)
    else:
        bonds = {
            "bonds": Bonds(0.3, 1e-6),
            "growing": Bonds(0.3, 1e-6, 1.0, "stretch", 0.7, 10.0, 2e-7, 1e-5, 0.5),
        }
        model = models.points_model(
            bonds[name], np.ones(21), force, shear_modes(soft, 0.3 * force, 1e-6, 21)
        )
    want = plain.march(basis, drive, model, 3, 1600, 3).response
    got = varying_load.march(basis, drive, sets, law, 3, 1600, 3, shear=reduced(sets, law)).response
    assert np.abs(got.force).max() > 0.7 * 0.3 * LOAD and 3e-6 < np.abs(got.slide).max() < 2e-5
    assert got.slide == pytest.approx(want.slide, abs=1e-6 * np.abs(want.slide).max())
    assert got.force == pytest.approx(want.force, abs=5e-6 * 0.3 * LOAD)


def test_exact_pieces_spring_back_when_they_part():
    """In flight the pieces hold nothing: no force, no energy, no coordinate; what they held is booked as lost."""
    for name in ("plastic", "bonds"):
        done, gap = march_with_lift_off(name, reduced(crowned(), LAWS[name]))
        stored, _, created = done.response.extra["ledger"][1:]
        apart = done.response.extra["normal_load"] == 0
        assert stored[apart].max() <= 1e-20 * stored.max()
        assert gap <= 1e-11 and done.outcome is None and created[-1] == 0


@given(
    st.sampled_from(["plastic", "bonds", "growing"]),
    st.integers(0, 10**6),
    st.sampled_from([60, 200]),
    st.sampled_from([2, 6, 21]),
    st.sampled_from([1e-9, 3e-8, 1.5e-7]),
)
def test_always_pieces_that_give_way_create_nothing(name, seed, steps, count, depth):
    """Random modes, starts, drives and reductions, coarse steps, bouncing."""
    shear = reduced(crowned(), LAWS[name], count, depth)
    check_energy_of_random_march(name, seed, steps, shear)


@pytest.mark.parametrize("count", [0, 6])
def test_exact_a_fork_goes_on_by_itself(count):
    """The twin of a run, forked after a cycle and marched after the run itself went on: the same samples."""
    law = LAWS["bonds"]
    drive = SineDrive(60.0, 2 * np.pi * 143)
    shear = reduced(crowned(), law, count) if count else None
    run = plain.start_run(
        MIXED, drive, varying_load.make_model(MIXED, law, crowned(), None, shear), 200
    )
    run.march_cycle(200, 0, [])
    twin = run.fork(drive)
    first = run.march_cycle(200, 0, [])[1]
    second = twin.march_cycle(200, 0, [])[1]
    assert np.abs(first - second).max() <= 1e-13 * np.abs(first).max() and np.ptp(first[:, 0]) > 0


def test_refuses_shear_beside_a_set_valued_law():
    law = LAWS["plastic"]
    for other in ("coulomb", "tanh"):
        with pytest.raises(PatchfemError, match="elastic-plastic"):
            varying_load.make_model(
                modes([100.0], [1.0], [1.0], [0.0]),
                LAWS[other],
                crowned(),
                shear=reduced(crowned(), law, 4),
            )
    few = shear_modes(giving(crowned().x), 0.3 * crowned().reference.forces(0.0, 0.0), 1e-6, 4)
    with pytest.raises(PatchfemError, match="include every node"):
        varying_load.make_model(modes([100.0], [1.0], [1.0], [0.0]), law, crowned(), shear=few)


@pytest.mark.parametrize("name", ["plastic", "bonds"])
def test_order_two_of_pieces_that_give_way(name):
    """Slide, heave and pitch in every mode, sets that change; what springs back at the end of a step does not lower the
    order."""
    check_order_two(name, 800, 0.45, reduced(crowned(), LAWS[name], 8))
