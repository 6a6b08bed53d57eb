"""Engines of a bench agree with references in NumPy, and their errors, energy balance and progress
are right."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from bond_moments import advance_bonds
from friction_paths import reference_bond_lengths

from patchfem import build
from patchfem.friction import steady_loop
from patchfem.runs.bench import bench
from patchfem.runs.bench.slides import find_rest_ends
from patchfem.runs.rig.rig import estimate_slide_errors
from patchfem.runs.run import run
from patchfem.scene import loads
from patchfem.time_steps.slides import BLOCK

POINT = '[normal]\nload = "100 N"\n'
FRICTION = "[friction]\nstatic = 0.3\n"
BONDS = 'law = "nonlocal"\nbond_length = "2 um"\n'
GROWTH = 'kinetic = 0.15\nrest_growth = "2 m/s^2"\nslip_growth = "1 um"\nrest_speed = "10 um/s"\n'
SLIDES = {
    "sine": 'kind = "sine"\namplitude = "4 um"\nfrequency = "50 Hz"\ncycles = 2\n',
    "small": 'kind = "sine"\namplitude = "0.1 um"\nfrequency = "50 Hz"\ncycles = 2\n',
    "dwell": 'kind = "dwell"\nspeed = "1 mm/s"\ndistance = "20 um"\nhold = "0.3 s"\ndistance_after = "10 um"\n',
}  # fmt: skip
ROUND_OFF_LAWS = {
    "coulomb": 'law = "coulomb"\n', "coulomb that holds more": 'law = "coulomb"\nkinetic = 0.2\n',
    "tanh": 'law = "tanh"\nreference_speed = "1 mm/s"\n',
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "2 um"\n',
    "averaged": 'law = "convolution"\nbond_length = "0.8 mm"\n',
    "bonds": BONDS + "initial_bonds = 0.4\n", "growing": BONDS + GROWTH,
}  # fmt: skip


def build_bench(law, slide, *sets, contact=POINT):
    """Return the model of a bench with a friction law and a slide."""
    return build(loads(contact + FRICTION + law + "[slide]\n" + SLIDES[slide], sets=sets))


class ReferenceHistory(NamedTuple):
    """Forces [N] after the steps of a slide, their path means, and dissipated and stored energies [J], (k,) each."""

    force: np.ndarray
    mean: np.ndarray
    dissipated: np.ndarray
    stored: np.ndarray


def follow_sliding(fraction, slide):
    """Return the history of a law without memory: a fraction (k,) of the limit of 30 N; NaN keeps the last force."""
    last = np.maximum.accumulate(np.where(np.isnan(fraction), 0, np.arange(fraction.size)))
    force = 30.0 * fraction[last]
    return ReferenceHistory(force, force, force * np.diff(slide), np.zeros(force.size))


def follow_springs(slide, length):
    """Return the history of a spring of 30 N/length that slips at 30 N."""
    rows = []
    stretch = 0.0
    for dq in np.diff(slide):
        after = np.clip(stretch + dq, -length, length)
        elastic = (after - stretch) / dq if dq else 1.0
        mean = 30.0 / length * (elastic * (stretch + after) / 2 + (1 - elastic) * after)
        gain = 15.0 / length * (after**2 - stretch**2)
        rows.append((30.0 / length * after, mean, mean * dq - gain, 15.0 / length * after**2))
        stretch = after
    return ReferenceHistory(*np.transpose(rows))


def follow_bonds(law, slide, times):
    """Return the history of bonds by their moments in NumPy, with bond lengths by eq. 2.10 in closed form."""
    rows = []
    bonds = np.array([[100.0 * law.initial], [0.0], [0.0]])
    middles = reference_bond_lengths(law, slide, times)[1]
    for dq, length in zip(np.diff(slide), middles):
        moved = advance_bonds(bonds, dq, np.array([100.0]), length)
        bonds = moved.bonds
        values = (bonds[1, 0], moved.mean[0], moved.damage_integral[0] / 2, bonds[2, 0] / 2)
        rows.append(law.static / law.length * np.array(values))
    return ReferenceHistory(*np.transpose(rows))


def follow_reference(model, slide, times):
    """Return the `ReferenceHistory` of the law of a bench of one point under 100 N."""
    friction = model.friction
    steps = np.diff(slide)
    if friction.law == "nonlocal":
        return follow_bonds(model.bonds, slide, times)
    if friction.law == "elastic-plastic":
        return follow_springs(slide, friction.bond_length)
    if friction.law == "tanh":
        return follow_sliding(np.tanh(steps / times / friction.reference_speed), slide)
    ratio = (getattr(friction, "kinetic", None) or friction.static) / friction.static
    return follow_sliding(np.where(steps == 0, np.nan, ratio * np.sign(steps)), slide)


# ---- engines and references in NumPy


@pytest.mark.share(0, 4, 8, 10, 13, 17, 19, 23)
@pytest.mark.parametrize("slide", SLIDES)
@pytest.mark.parametrize("law", ROUND_OFF_LAWS)
def test_exact_bench_agrees_with_reference(law, slide):
    """The bench agrees with its law stepped in NumPy to round-off, in force, slip and energies."""
    model = build_bench(ROUND_OFF_LAWS[law], slide)
    run = bench.run_bench(model, None, 80)
    path = follow_reference(model, run.slide, np.diff(run.time))
    limit = np.abs(run.force).max()
    force = np.append(0.0, path.force)
    # At the end of a rest, the bench has the static force of the motion that follows.
    ends = find_rest_ends(model, run.slide)
    is_static = np.isin(np.arange(force.size), [*ends])
    assert run.force[is_static] == pytest.approx(30.0 * np.array([*ends.values()]), rel=1e-13)
    assert run.force[~is_static] == pytest.approx(force[~is_static], abs=1e-13 * limit)
    is_elastic = law in ("elastic-plastic", "bonds", "growing")
    stretch = np.clip(force / 30.0, -1, 1) * (2e-6 if is_elastic else 0.0)
    assert run.slip == pytest.approx(run.slide - stretch, abs=1e-18)
    work = np.append(0.0, np.cumsum(path.mean * np.diff(run.slide)))
    exchanged = np.abs(np.diff(work)).sum()
    assert run.ledger[0] == pytest.approx(work, abs=1e-13 * exchanged)
    assert run.ledger[1] == pytest.approx(np.append(0.0, path.stored), abs=1e-13 * exchanged)
    assert run.ledger[2, -1] == pytest.approx(path.dissipated.sum(), abs=1e-13 * exchanged)


@pytest.mark.parametrize("law", ["coulomb", "tanh", "elastic-plastic", "bonds"])
def test_exact_faces_without_friction_slip_with_the_slide(law):
    """Without friction nothing stretches: the slip is the slide, and all energies are 0."""
    model = build_bench(ROUND_OFF_LAWS[law], "sine", "friction.static=0")
    run = bench.run_bench(model, None, 80)
    assert run.slip == pytest.approx(run.slide, abs=1e-18)
    assert not run.force.any() and not run.ledger.any()


def test_exact_velocity_under_changing_load_is_that_of_the_slide():
    """Samples that a changing load adds near those of the slide do not disturb its velocity."""
    changing = POINT + 'amplitude = "30 N"\nfrequency = "55 Hz"\n'
    run = bench.run_bench(
        build_bench(ROUND_OFF_LAWS["coulomb"], "sine", contact=changing), None, 400
    )
    omega = 2 * np.pi * 50
    exact = 4e-6 * omega * np.cos(omega * run.time)
    assert run.rate[1:-1] == pytest.approx(exact[1:-1], abs=1e-4 * np.abs(exact).max())


@pytest.mark.parametrize("load", ["1 N", "1e9 N", "1e50 N"])
def test_always_round_off_is_in_error_of_equivalent_stiffness(load):
    """The equivalent stiffness of rigid friction is 0 within its error, at any load.

    The friction force lags the slide by a quarter cycle, so that the value is nothing but round-off.
    """
    slide = SLIDES["sine"].replace("4 um", "10 um").replace("50 Hz", "1 Hz")
    scene = loads(
        POINT + FRICTION + 'law = "coulomb"\n[slide]\n' + slide, sets=[f"normal.load={load}"]
    )
    stiffness = run(scene).measures["equivalent_stiffness"]
    assert 0 < abs(stiffness.value) <= stiffness.error < 1e-6 * stiffness.floor


# ---- progress


def test_always_progress_grows_to_one():
    """The reported progress never falls and ends at 1."""
    fractions = []
    model = build_bench(BONDS + "order = 2\n", "sine", "accuracy.steps_per_cycle=6000")
    run(model, progress=fractions.append, estimate=False)
    assert fractions[-1] == 1.0 and (np.diff([0.0, *fractions]) >= 0).all()
    assert len(fractions) >= 12000 // BLOCK


# ---- energy balance and work check


@pytest.mark.parametrize(
    "chi, beta, amplitude",
    [(-0.4, 0.5, 2e-9), (0.0, 0.0, 2e-7), (-0.9, 2.0, 1e-5)],
)
def test_exact_iwan_loop_agrees_with_closed_form(chi, beta, amplitude):
    """The area and the peak force of the steady loop of the Iwan law agree to round-off with the closed form (Segalman
    2005), and within their errors."""
    scene = loads(
        '[normal]\nload = "5 kN"\n[friction]\nlaw = "iwan"\nstatic = 0.3\nstiffness = "1e9 N/m"\n'
        f'chi = {chi}\nbeta = {beta}\n[slide]\nkind = "sine"\namplitude = "{amplitude!r} m"\n'
        'frequency = "1 Hz"\ncycles = 2\n'
    )
    tip, area = steady_loop(scene.friction, 5e3, amplitude)
    measures = run(scene).measures
    for name, exact in (
        ("loop_area", area),
        ("friction_force_peak", tip),
        ("secant_stiffness", tip / amplitude),
    ):
        difference = abs(measures[name].value - exact)
        assert difference <= 1e-9 * abs(exact), name
        # A smooth peak between two samples is part of the error of a peak.
        assert 0 < measures[name].error < 1e-7 * abs(exact), name


def test_exact_full_list_of_bonds_widens_errors():
    """Joins that make room in a full list dominate the error of the sum over bonds."""
    model = build(
        '[normal]\nload = "10 N"\n[friction]\nlaw = "nonlocal"\nstatic = 0.3\nbond_length = "2 um"\norder = 2\n'
        '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "1 Hz"\ncycles = 1\n'
    )
    fine = bench.run_bench(model, None, 40)
    free, forced = (
        max(errors["loop_area"] for _, errors in estimate_slide_errors(model, [None], one, 40))
        for one in (fine, replace(fine, join_error=0.1))
    )
    assert fine.join_error == 0 and forced > 10 * free
