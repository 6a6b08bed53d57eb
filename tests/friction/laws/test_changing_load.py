"""Normal load that varies in time: traction kept by the laws, lift-off, and the bench with N(t)."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from friction_paths import march_under_loads
from scene_texts import BENCH
from scipy.integrate import quad

from patchfem import build
from patchfem.core import Missing
from patchfem.friction import BondGrowth, Bonds
from patchfem.runs.bench import bench as law_bench
from patchfem.scene import loads

GROWTH = {"ratio": 0.5, "growth": BondGrowth(0.4, 0.3, 0.01)}


@pytest.mark.parametrize("order, growth", [(1.0, {}), (1.0, GROWTH), (0.0, {}), (2.0, GROWTH)])
def test_always_bonds_under_varying_load_are_passive(order, growth):
    """Bonds of the stretch law under a varying load never create energy, and their energy balance closes.

    At rest, bonds of order 1 stay below the limit, and keep their traction where the load rises.
    """
    for seed in range(8):
        rng = np.random.default_rng(seed)
        law = Bonds(0.4, 1.0, order, initial=float(rng.uniform(0, 1)), **growth)
        steps = rng.normal(size=60) * 10 ** rng.uniform(-3, 1, 60)
        steps[::2] = 0.0
        loads = rng.uniform(0, 2, 61) * (rng.random(61) < 0.9)
        loads[2::2] = np.where(rng.random(30) < 0.5, loads[2::2], loads[1::2])
        path = np.append(0.0, np.cumsum(steps))
        times = 10 ** rng.uniform(-3, 2, 60)
        run = march_under_loads(law, path, loads, times, None if order == 1 else 0.0)
        works = run.mean * steps
        scale = np.abs(works).sum()
        assert run.dissipated.min() >= -1e-7 * scale
        balance = np.cumsum(works - run.dissipated) - run.stored
        assert np.abs(balance).max() <= 1e-7 * scale
        if order == 1:
            traction = run.traction[::2, 0]
            before = np.append(0.0, run.traction[1:-1:2, 0])
            rises = (loads[1::2] >= loads[:-1:2]) & (loads[:-1:2] > 0)
            assert (np.abs(traction) <= 0.4 * loads[1::2] * (1 + 1e-12))[~rises].all()
            assert np.abs(traction - before)[rises].max() < 1e-12


PLASTIC = SimpleNamespace(law="elastic-plastic", static=0.3, bond_length=1.0)
LAWS = [
    (PLASTIC, None),
    (Bonds(0.3, 1.0), None),
    (Bonds(0.3, 1.0), 0.0),
    (Bonds(0.3, 1.0, 2.0), 0.0),
    (Bonds(0.3, 1.0, 0.0), 0.0),
    (Bonds(0.3, 1.0, 0.0, "report"), 0.0),
    (Bonds(0.3, 1.0, 1.0, "report"), 0.0),
]


@pytest.mark.parametrize("law, tail", LAWS)
def test_exact_lift_off_erases_traction_and_memory(law, tail):
    """A lift-off sets traction and stored energy to zero, and the law then follows a path as from its initial state.

    A list forms no bonds at rest, so that it then has the traction of a list without initial bonds.
    """
    first = np.array([0.0, 0.7, 1.1, 0.9])
    after = 0.9 + np.array([0.0, 0.0, 0.3, 0.6, 0.1])
    path = np.concatenate([first, after])
    run = march_under_loads(law, path, [1.0] * 4 + [0.0] + [1.0] * 4, 1.0, tail)
    assert run.traction[3, 0] == run.stored[3] == 0.0
    assert run.dissipated[3] == pytest.approx(run.stored[2], abs=1e-15)
    fresh_law = law if tail is None else replace(law, initial=0.0)
    fresh = march_under_loads(fresh_law, after[1:] - 0.9, np.ones(4), 1.0, tail)
    assert run.traction[5:] == pytest.approx(fresh.traction, abs=1e-14)
    assert run.mean[5:] == pytest.approx(fresh.mean, abs=1e-14)


@pytest.mark.share(0, 3, 8)
@pytest.mark.parametrize("law, tail", LAWS)
@pytest.mark.parametrize("load_amplitude", [0.1, 0.2])
def test_exact_alternating_load_causes_no_drift(law, tail, load_amplitude):
    """A load that alternates at rest leaves the traction at half the friction limit unchanged, so nothing slips.

    Bonds that are known by their moments keep it as long as m >= z^2/s2; the first fall of the load beyond that reduces it.
    """
    loading = march_under_loads(law, np.linspace(0.0, 2.0, 201), np.ones(201), 0.01, tail)
    count = int(np.argmax(np.abs(loading.traction[:, 0]) > 0.15))
    path = np.append(0.01 * np.arange(count + 1), np.full(18, 0.01 * count))
    cycle = [1 - load_amplitude, 1 + load_amplitude, 1.0]
    run = march_under_loads(law, path, np.append(np.ones(count + 1), 6 * cycle), 0.01, tail)
    traction = run.traction[count - 1, 0]
    if tail is None and law is not PLASTIC:
        # Sums over the bonds after a path q without reversal in bond lengths: z = 1 - exp(-q) and s2.
        q = path[-1]
        moment = 2 - 2 * (1 + q) * np.exp(-q)
        traction *= min(1.0, (1 - load_amplitude) * moment / (1 - np.exp(-q)) ** 2)
    assert run.traction[count:, 0] == pytest.approx(traction, abs=1e-15)


def load_bench(motion, normal):
    """Return the scene of a bench with Coulomb friction under 100 N."""
    text = f'[normal]\nload = "100 N"\n{normal}\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n[slide]\n{motion}\n'
    return loads(text, "bench.toml")


VARYING_LOAD = 'amplitude = "40 N"\nfrequency = "300 Hz"\nphase = "0.5 rad"'
CONSTANT_SPEED = 'kind = "constant"\nspeed = "1 mm/s"\ndistance = "20 um"'


@pytest.mark.parametrize("amplitude", ["40 N", "150 N"])
def test_order_coulomb_work_under_varying_load(amplitude):
    """The friction work of Coulomb's law under a sinusoidal load converges to the integral of the limit over the path."""
    model = build(load_bench(CONSTANT_SPEED, VARYING_LOAD.replace("40 N", amplitude)))
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


def test_exact_coulomb_force_at_rest_follows_falling_load():
    """At rest, Coulomb's law keeps its force as far as the smallest limit since the stop allows."""
    motion = 'kind = "dwell"\nspeed = "1 mm/s"\ndistance = "20 um"\nhold = "10 ms"\ndistance_after = "20 um"'
    model = build(load_bench(motion, VARYING_LOAD))
    result = law_bench.run_bench(model, None, 800)
    rests = np.flatnonzero(np.diff(result.slide) == 0) + 1
    smallest = np.minimum.accumulate(result.load[rests[0] - 1 : rests[-1] + 1])[1:]
    assert result.force[rests] == pytest.approx(0.3 * smallest, rel=1e-12)
    assert smallest[-1] < 0.8 * smallest[0]


def test_refuses_load_frequency_beyond_resolution():
    """A load whose frequency cannot be resolved by the samples is refused with the key to change."""
    scene = loads(
        BENCH,
        "a.toml",
        ["normal.amplitude=1 N", "normal.frequency=1000000 kHz", "slide.cycles=1000"],
    )
    with pytest.raises(Missing, match=r"lower normal\.frequency"):
        law_bench.run_bench(build(scene), None, 400)
