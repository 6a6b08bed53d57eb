"""A load that changes in time: what the laws keep of a held force, lift-off, and the bench under N(t)."""

import numpy as np
import pytest
from friction_paths import random_walk
from scene_texts import BENCH
from scipy.integrate import quad
from scipy.special import gammainc

from patchfem import build, plan
from patchfem.core import Missing
from patchfem.friction import Bonds, Coulomb, FirstOrderBonds, Quadrature, TanhLaw
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.runs.bench import bench as law_bench
from patchfem.runs.run import run
from patchfem.scene import loads

GROWTH = {"ratio": 0.5, "rest_growth": 0.4, "slip_growth": 0.3, "rest_speed": 0.01}


def test_exact_the_sum_over_bonds_lets_go_what_the_recursion_does():
    rng = np.random.default_rng(4)
    for growth, share in (({}, 0.0), (GROWTH, 0.0), (GROWTH, 0.4)):
        law = Bonds(0.4, 1.0, initial=0.6, breakaway=share, **growth)
        sum_ = Quadrature(law, 0.0)
        state_law = FirstOrderBonds(law)
        sigma = rng.uniform(0, 2, 4)
        a = sum_.start(sigma)
        b = state_law.start(sigma)
        for dq in np.diff(random_walk(2, 60, 0.8)):
            after = rng.uniform(0, 2, 4) * (rng.random(4) < 0.9)
            pressed = sum_.press(a, sigma, after), state_law.press(b, sigma, after)
            steps = [
                engine.step(part.state, float(dq), after, after, 0.5)
                for engine, part in zip((sum_, state_law), pressed)
            ]
            for one, two in (pressed, steps):
                assert one.mean == pytest.approx(two.mean, abs=1e-10)
                assert one.dissipated == pytest.approx(two.dissipated, abs=1e-10)
            (a, b), sigma = (step.state for step in steps), after


@pytest.mark.parametrize("order", [0.0, 0.5, 2.0])
def test_exact_other_orders_let_the_last_formed_bonds_go_first(order):
    """Slid one length from no bonds: those of the last 0.1 hold the least; a load down to their end takes these."""
    law = Quadrature(Bonds(1.0, 1.0, order, initial=0.0), 0.0)
    one = np.ones(1)
    state = law.start(np.ones(1))
    for _ in range(10):
        state = law.step(state, 0.1, one, one, 1.0).state
    mass = 1 - np.exp(-1.0)
    gone = law.press(state, one, one * (1 - (1 - np.exp(-0.1)) / mass))
    wanted = gammainc(order + 1, 1.0) - gammainc(order + 1, 0.1)
    bound = 1 - (1 - np.exp(-0.1)) / mass
    assert gone.mean[0] == pytest.approx(min(wanted, bound), abs=2e-4 if order % 1 else 1e-6)


LAWS = [
    Coulomb(0.3),
    TanhLaw(0.3, 1.0),
    ElasticPlastic(0.3, 1.0),
    FirstOrderBonds(Bonds(0.3, 1.0)),
    Quadrature(Bonds(0.3, 1.0), 0.0),
    Quadrature(Bonds(0.3, 1.0, 2.0), 0.0),
    Quadrature(Bonds(0.3, 1.0, 0.0), 0.0),
    Quadrature(Bonds(0.3, 1.0, 0.0, "report"), 0.0),
    Quadrature(Bonds(0.3, 1.0, 1.0, "report"), 0.0),
]


@pytest.mark.parametrize("law", LAWS)
def test_exact_lost_contact_takes_force_and_memory(law):
    """After a lift-off the law follows a slide as one that never carried."""
    one = np.ones(1)
    state = law.start(np.ones(1))
    for dq in (0.7, 0.4, -0.2):
        state = law.step(state, dq, one, one, 1.0).state
    held = law.stored_energy(state)[0]
    off = law.press(state, one, 0 * one)
    assert law.traction(off.state)[0] == law.stored_energy(off.state)[0] == off.mean[0] == 0.0
    assert off.dissipated[0] == pytest.approx(held, abs=1e-15)
    state = law.press(off.state, 0 * one, one).state
    new = law.start(one)
    report = isinstance(law, Quadrature) and law.law.reading == "report"
    for dq in (0.3, 0.3, -0.5):
        a = law.step(state, dq, one, one, 1.0)
        b = law.step(new, dq, one, one, 1.0)
        if not report:  # the print forms no bonds at rest: it starts without the first cohort
            assert a.mean[0] == pytest.approx(b.mean[0], abs=1e-14)
        assert np.isfinite(a.mean[0])
        state = a.state
        new = b.state


@pytest.mark.share(0, 1, 2, 3, 4, 5, 6)
@pytest.mark.parametrize("law", [law for law in LAWS if not isinstance(law, (Coulomb, TanhLaw))])
@pytest.mark.parametrize("size", [0.1, 0.2])
def test_exact_no_drift_under_a_load_dither_at_half_the_limit(law, size):
    """The slide that restores half the limit after every half cycle of the load is the same in every cycle: 0."""
    one = np.ones(1)
    state = law.start(np.ones(1))
    for _ in range(400):  # up to half the limit in small steps
        after = law.step(state, 0.01, one, one, 0.01)
        if law.traction(after.state)[0] > 0.15:
            break
        state = after.state
    seen = []
    for _ in range(6):
        for before, now in (
            (one, (1 - size) * one),
            ((1 - size) * one, (1 + size) * one),
            ((1 + size) * one, one),
        ):
            state = law.press(state, before, now).state
        seen.append(law.traction(state)[0])
    assert seen[-1] == pytest.approx(seen[1], abs=1e-15)  # nothing to restore: nothing slides
    if not (isinstance(law, Quadrature) and law.law.order != 1):
        assert seen[0] == pytest.approx(seen[1], abs=1e-15)


def bench(law, slide, normal):
    text = (
        f'[normal]\nload = "100 N"\n{normal}\n[friction]\n{law}\nstatic = 0.3\n[slide]\n{slide}\n'
    )
    return loads(text, "bench.toml")


SWING = 'amplitude = "40 N"\nfrequency = "300 Hz"\nphase = "0.5 rad"'
CONSTANT = 'kind = "constant"\nspeed = "1 mm/s"\ndistance = "20 um"'


@pytest.mark.parametrize("amplitude", ["40 N", "150 N"])
def test_order_work_of_coulomb_under_a_swinging_load(amplitude):
    model = build(bench('law = "coulomb"', CONSTANT, SWING.replace("40 N", amplitude)))
    height = float(amplitude.split()[0])
    load = lambda t: max(100 + height * np.cos(2 * np.pi * 300 * t + 0.5), 0.0)  # noqa: E731
    wanted = 0.3e-3 * quad(load, 0, 0.02, limit=500, epsabs=1e-12)[0]
    errors = [
        abs(law_bench.run(model, None, steps).values["friction_work"] / wanted - 1)
        for steps in (40, 80)
    ]
    assert errors[1] <= 3e-4 and errors[1] < errors[0] / 3
    found = law_bench.run(model, None, 40)
    assert found.force == pytest.approx(0.3 * found.load * (found.slide > 0), abs=1e-12)
    if height > 100:
        assert (found.load == 0).any() and found.values["friction_ratio_peak"] == pytest.approx(0.3)


def test_exact_samples_hold_the_instants_without_load():
    model = build(bench('law = "coulomb"', CONSTANT, SWING.replace("40 N", "150 N")))
    time, slide = model.point.refine_samples(
        model.slide, np.linspace(0, 0.02, 11), np.linspace(0, 2e-5, 11), 16
    )
    turns = (
        np.arange(-1, 8)[:, None] + np.array([1, -1]) * np.arccos(-100 / 150) / (2 * np.pi)
    ).ravel()
    edges = (turns - 0.5 / (2 * np.pi)) / 300
    edges = edges[(edges > 0) & (edges < 0.02)]
    assert all(np.abs(time - edge).min() <= 1e-15 for edge in edges) and edges.size >= 11
    assert slide == pytest.approx(1e-3 * time, abs=1e-18) and (np.diff(time) > 0).all()


def test_refuses_a_load_too_fast_to_resolve():
    scene = loads(
        BENCH,
        "a.toml",
        ["normal.amplitude=1 N", "normal.frequency=1000000 kHz", "slide.cycles=1000"],
    )
    with pytest.raises(Missing, match=r"lower normal\.frequency"):
        law_bench.run(build(scene), None, 400)


@pytest.mark.parametrize(
    "order, reading", [(1.0, "report"), (2.0, "report"), (0.0, "report"), (0.5, "stretch")]
)
def test_exact_ledger_of_every_reading_closes_and_creation_is_seen(order, reading):
    """Triangle of the C7 kind: V + dissipated - created is the work; only the print creates."""
    scene = bench(
        f'law = "nonlocal"\nbond_length = "2 um"\norder = {order}\nreading = "{reading}"\ninitial_bonds = 0',
        'kind = "triangle"\nspeed = "1 mm/s"\namplitude = "0.2 um"\ncycles = 4',
        "",
    )
    result = run(plan(scene), estimate=False)
    value = {name: m.value for name, m in result.measures.items()}
    total = value["energy_stored"] + value["energy_dissipated"] - value["energy_created"]
    assert total == pytest.approx(
        value["friction_work"], abs=1e-12 * value["energy_stored"] + 1e-15
    )
    creates = reading == "report" and order > 0
    assert (value["energy_created"] > 1e-3 * value["energy_stored"]) == creates
    assert any("created" in line for line in result.warnings) == creates


def test_exact_ledger_of_a_march_closes_step_by_step():
    """Work = stored + dissipated - created at every kept sample; the printed law creates, the stretch does not."""
    from scene_texts import STRUCTURE

    for reading, creates in (("stretch", False), ("report", True)):
        law = f'"nonlocal"\nbond_length = "1 um"\nreading = "{reading}"'
        text = STRUCTURE + BENCH.split("[slide]")[0].replace('"coulomb"', law)
        result = run(plan(loads(text, "a.toml", ["drive.cycles=6"])))
        work, stored, dissipated, created = result.response.extra["ledger"]
        assert np.abs(work - stored - dissipated + created).max() <= 1e-12 * dissipated[-1]
        assert (np.diff(dissipated) >= 0).all() and (np.diff(created) >= 0).all()
        assert result.measures["friction_work"].value == work[-1] and work[-1] > 0
        assert (created[-1] > 1e-6 * dissipated[-1]) == creates and (creates or created[-1] == 0)
