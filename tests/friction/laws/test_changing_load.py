"""Normal load that varies in time: traction kept by the laws, lift-off, and the bench with N(t)."""

import numpy as np
import pytest
from scene_texts import BENCH
from scipy.integrate import quad
from scipy.special import gammainc

from patchfem import build, plan
from patchfem.core import Missing
from patchfem.friction import Bonds, Coulomb
from patchfem.friction.bonds.points import FirstOrderBonds, ListedBonds
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.friction.laws.tanh import TanhLaw
from patchfem.runs.bench import bench as law_bench
from patchfem.runs.run import run
from patchfem.scene import loads

GROWTH = {"ratio": 0.5, "rest_growth": 0.4, "slip_growth": 0.3, "rest_speed": 0.01}


def check_random_path_with_varying_load(law, length_scale, rng):
    """Check the energy balance, the limit and the sign of the dissipation of a law on a random path of 12 points."""
    sigma = rng.uniform(0, 2, 12)
    state = law.initial_state(sigma)
    for _ in range(30):
        after = rng.uniform(0, 2, 12) * (rng.random(12) < 0.9)
        press = law.press(state, sigma, after)
        falls = after < sigma
        assert (np.abs(press.mean) <= 0.4 * after * (1 + 1e-12))[falls].all()
        assert np.abs(press.mean - law.traction(state))[~falls & (sigma > 0)].max(initial=0) < 1e-12
        dq = float(rng.normal() * 10 ** rng.uniform(-3, 1)) * length_scale
        ahead = rng.uniform(0, 2, 12) if rng.random() < 0.5 else after
        step = law.step(press.state, dq, after, ahead, 10 ** rng.uniform(-3, 2))
        size = np.abs(step.mean * dq) + law.stored_energy(state) + 1e-9
        gain = law.stored_energy(step.state) - law.stored_energy(press.state)
        assert np.abs((step.mean * dq - gain - step.dissipated) / size).max() <= 1e-11
        assert min((press.dissipated / size).min(), (step.dissipated / size).min()) >= -1e-7
        state = step.state
        sigma = ahead


@pytest.mark.parametrize("order", [1.0, 0.0, 0.5, 2.0])
@pytest.mark.parametrize("growth", [{}, GROWTH])
def test_always_bonds_under_varying_load_are_passive(order, growth):
    """Bonds of the stretch law under a varying load never create energy and stay below the limit at rest."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        bonds = Bonds(0.4, 1.0, order, initial=float(rng.uniform(0, 1)), **growth)
        law = FirstOrderBonds(bonds) if order == 1 else ListedBonds(bonds, 0.0)
        check_random_path_with_varying_load(law, 1.0, rng)


@pytest.mark.parametrize("order", [0.0, 0.5, 2.0])
def test_exact_unloading_breaks_newest_bonds_first(order):
    """A falling load breaks the bonds that formed last, which carry the least, for orders other than one."""
    law = ListedBonds(Bonds(1.0, 1.0, order, initial=0.0), 0.0)
    unit = np.ones(1)
    state = law.initial_state(np.ones(1))
    for _ in range(10):
        state = law.step(state, 0.1, unit, unit, 1.0).state
    mass = 1 - np.exp(-1.0)
    unloaded = law.press(state, unit, unit * (1 - (1 - np.exp(-0.1)) / mass))
    expected = gammainc(order + 1, 1.0) - gammainc(order + 1, 0.1)
    bound = 1 - (1 - np.exp(-0.1)) / mass
    assert unloaded.mean[0] == pytest.approx(min(expected, bound), abs=2e-4 if order % 1 else 1e-6)


LAWS = [
    Coulomb(0.3),
    TanhLaw(0.3, 1.0),
    ElasticPlastic(0.3, 1.0),
    FirstOrderBonds(Bonds(0.3, 1.0)),
    ListedBonds(Bonds(0.3, 1.0), 0.0),
    ListedBonds(Bonds(0.3, 1.0, 2.0), 0.0),
    ListedBonds(Bonds(0.3, 1.0, 0.0), 0.0),
    ListedBonds(Bonds(0.3, 1.0, 0.0, "report"), 0.0),
    ListedBonds(Bonds(0.3, 1.0, 1.0, "report"), 0.0),
]


@pytest.mark.parametrize("law", LAWS)
def test_exact_lift_off_erases_traction_and_memory(law):
    """A lift-off sets traction and stored energy to zero, and the law then follows a path as from its initial state."""
    unit = np.ones(1)
    state = law.initial_state(np.ones(1))
    for dq in (0.7, 0.4, -0.2):
        state = law.step(state, dq, unit, unit, 1.0).state
    stored_energy = law.stored_energy(state)[0]
    lift_off = law.press(state, unit, 0 * unit)
    assert (
        law.traction(lift_off.state)[0]
        == law.stored_energy(lift_off.state)[0]
        == lift_off.mean[0]
        == 0.0
    )
    assert lift_off.dissipated[0] == pytest.approx(stored_energy, abs=1e-15)
    state = law.press(lift_off.state, 0 * unit, unit).state
    fresh_state = law.initial_state(unit)
    is_printed_law = isinstance(law, ListedBonds) and law.law.reading == "report"
    for dq in (0.3, 0.3, -0.5):
        after_lift_off = law.step(state, dq, unit, unit, 1.0)
        fresh = law.step(fresh_state, dq, unit, unit, 1.0)
        if (
            not is_printed_law
        ):  # the printed law forms no bonds at rest, so the initial bonds are missing
            assert after_lift_off.mean[0] == pytest.approx(fresh.mean[0], abs=1e-14)
        assert np.isfinite(after_lift_off.mean[0])
        state = after_lift_off.state
        fresh_state = fresh.state


@pytest.mark.share(0, 3)
@pytest.mark.parametrize("law", [law for law in LAWS if not isinstance(law, (Coulomb, TanhLaw))])
@pytest.mark.parametrize("load_amplitude", [0.1, 0.2])
def test_exact_alternating_load_causes_no_drift(law, load_amplitude):
    """A load that alternates at rest leaves the traction at half the friction limit unchanged, so nothing slips."""
    unit = np.ones(1)
    state = law.initial_state(np.ones(1))
    for _ in range(400):  # small steps up to half the friction limit
        after = law.step(state, 0.01, unit, unit, 0.01)
        if law.traction(after.state)[0] > 0.15:
            break
        state = after.state
    tractions = []
    for _ in range(6):
        for load_before, load_after in (
            (unit, (1 - load_amplitude) * unit),
            ((1 - load_amplitude) * unit, (1 + load_amplitude) * unit),
            ((1 + load_amplitude) * unit, unit),
        ):
            state = law.press(state, load_before, load_after).state
        tractions.append(law.traction(state)[0])
    assert tractions[-1] == pytest.approx(
        tractions[1], abs=1e-15
    )  # the traction is unchanged, so no slip is needed to restore it
    if not (isinstance(law, ListedBonds) and law.law.order != 1):
        assert tractions[0] == pytest.approx(tractions[1], abs=1e-15)


def load_bench(law, motion, normal):
    """Return the scene of a bench under 100 N."""
    text = (
        f'[normal]\nload = "100 N"\n{normal}\n[friction]\n{law}\nstatic = 0.3\n[slide]\n{motion}\n'
    )
    return loads(text, "bench.toml")


VARYING_LOAD = 'amplitude = "40 N"\nfrequency = "300 Hz"\nphase = "0.5 rad"'
CONSTANT_SPEED = 'kind = "constant"\nspeed = "1 mm/s"\ndistance = "20 um"'


@pytest.mark.parametrize("amplitude", ["40 N", "150 N"])
def test_order_coulomb_work_under_varying_load(amplitude):
    """The friction work of Coulomb's law under a sinusoidal load converges to the integral of the limit over the path."""
    model = build(
        load_bench('law = "coulomb"', CONSTANT_SPEED, VARYING_LOAD.replace("40 N", amplitude))
    )
    load_amplitude = float(amplitude.split()[0])
    load = lambda t: max(100 + load_amplitude * np.cos(2 * np.pi * 300 * t + 0.5), 0.0)  # noqa: E731
    expected = 0.3e-3 * quad(load, 0, 0.02, limit=500, epsabs=1e-12)[0]
    errors = [
        abs(law_bench.run_bench(model, None, steps).values["friction_work"] / expected - 1)
        for steps in (40, 80)
    ]
    assert errors[1] <= 3e-4 and errors[1] < errors[0] / 3
    result = law_bench.run_bench(model, None, 40)
    assert result.force == pytest.approx(0.3 * result.load * (result.slide > 0), abs=1e-12)
    if load_amplitude > 100:
        assert (result.load == 0).any() and result.values["friction_ratio_peak"] == pytest.approx(
            0.3
        )


def test_exact_samples_include_instants_of_zero_load():
    """The refined samples include the instants at which the load vanishes or returns."""
    model = build(
        load_bench('law = "coulomb"', CONSTANT_SPEED, VARYING_LOAD.replace("40 N", "150 N"))
    )
    time, slide = model.point.refine_samples(
        model.slide, np.linspace(0, 0.02, 11), np.linspace(0, 2e-5, 11), 16
    )
    turns = (
        np.arange(-1, 8)[:, None] + np.array([1, -1]) * np.arccos(-100 / 150) / (2 * np.pi)
    ).ravel()
    load_zeros = (turns - 0.5 / (2 * np.pi)) / 300
    load_zeros = load_zeros[(load_zeros > 0) & (load_zeros < 0.02)]
    assert all(np.abs(time - edge).min() <= 1e-15 for edge in load_zeros) and load_zeros.size >= 11
    assert slide == pytest.approx(1e-3 * time, abs=1e-18) and (np.diff(time) > 0).all()


def test_refuses_load_frequency_beyond_resolution():
    """A load whose frequency cannot be resolved by the samples is refused with the key to change."""
    scene = loads(
        BENCH,
        "a.toml",
        ["normal.amplitude=1 N", "normal.frequency=1000000 kHz", "slide.cycles=1000"],
    )
    with pytest.raises(Missing, match=r"lower normal\.frequency"):
        law_bench.run_bench(build(scene), None, 400)


@pytest.mark.parametrize("order, reading", [(1.0, "report"), (0.0, "report"), (0.5, "stretch")])
def test_exact_bench_energy_balance_of_both_forms(order, reading):
    """Work equals stored plus dissipated less created energy on the bench; only the printed law creates energy."""
    scene = load_bench(
        f'law = "nonlocal"\nbond_length = "2 um"\norder = {order}\nreading = "{reading}"\ninitial_bonds = 0',
        'kind = "triangle"\nspeed = "1 mm/s"\namplitude = "0.2 um"\ncycles = 4',
        "",
    )
    result = run(plan(scene), estimate=False)
    values = {name: m.value for name, m in result.measures.items()}
    total = values["energy_stored"] + values["energy_dissipated"] - values["energy_created"]
    assert total == pytest.approx(
        values["friction_work"], abs=1e-12 * values["energy_stored"] + 1e-15
    )
    creates_energy = reading == "report" and order > 0
    assert (values["energy_created"] > 1e-3 * values["energy_stored"]) == creates_energy
    assert any("created" in line for line in result.warnings) == creates_energy


def test_exact_march_energy_balance_closes_at_each_sample():
    """The energy balance closes at each sample of a march, and only the printed law creates energy."""
    from scene_texts import STRUCTURE

    for reading, creates_energy in (("stretch", False), ("report", True)):
        law = f'"nonlocal"\nbond_length = "1 um"\nreading = "{reading}"'
        text = STRUCTURE + BENCH.split("[slide]")[0].replace('"coulomb"', law)
        result = run(plan(loads(text, "a.toml", ["drive.cycles=6"])))
        work, stored, dissipated, created = result.response.extra["ledger"]
        assert np.abs(work - stored - dissipated + created).max() <= 1e-12 * dissipated[-1]
        assert (np.diff(dissipated) >= 0).all() and (np.diff(created) >= 0).all()
        assert result.measures["friction_work"].value == work[-1] and work[-1] > 0
        assert (created[-1] > 1e-6 * dissipated[-1]) == creates_energy and (
            creates_energy or created[-1] == 0
        )
