"""The stated error of merging, `engines.EngineChoice.error`, compared with the list of every bond.

Forces and step means are compared along many paths, with growing bonds and small amplitudes among them.
"""

import numpy as np
import pytest
from friction_paths import make_points, random_walk, triangle_path, upper_pressure
from march_paths import follow_path

from patchfem.friction import BondGrowth, Bonds, RequestedEngine, choose_engine

MERGED = RequestedEngine("merged")
GROWTH = {"ratio": 0.54, "growth": BondGrowth(0.145, 7.64, 4.55e-4)}
PHASE = np.arange(6 * 400 + 1) / 400 * 2 * np.pi
WALK = np.interp(np.arange(481) / 8, np.arange(61), 0.01 * random_walk(1, 60, 0.1))


def follow_list(law, path, dt, tail=0.0, merge=0.0):
    """Return the Path of a single list of bonds."""
    return follow_path(make_points(law, upper_pressure([1.0]), tail, merge), path, dt)


def compare_merged_with_full(law, path, steps, tolerance) -> float:
    """Return the error of merging relative to the stated error."""
    moves = np.diff(path)
    directions = np.sign(moves[moves != 0])
    strokes = 1 + np.count_nonzero(directions[1:] != directions[:-1])
    dt = 2 * np.pi / steps
    choice = choose_engine(
        law, tolerance, np.abs(moves).sum() / strokes, max(directions.size / strokes, 1), MERGED
    )
    full = follow_list(law, path, dt).forces
    change = np.abs(follow_list(law, path, dt, choice.tail, choice.merge).forces - full)
    is_moving = np.append(np.abs(moves) > 1e-9 * np.abs(moves).max(), False)
    return max(change[1:, 0].max(), change[is_moving, 1].max()) / choice.error


# Law, path, steps per cycle and tolerance; and the error relative to the stated one of earlier versions.
CASES = {
    # Step means of order 0 where forces jump: with a uniform strip 2.2.
    "jumps": (Bonds(1.0, 1.0, 0.0, initial=0.0, **GROWTH), 0.192 * np.clip(1.3 * np.sin(PHASE), -1, 1), 400, 4e-3),
    # The weight R^p is steep in young bonds: with uniform strips 6.
    "young": (
        Bonds(1.0, 1.0, -0.8, "report", initial=0.0),
        0.00536 * (np.exp(-PHASE / 6) * np.sin(PHASE + 1) - np.sin(1)), 400, 2.9e-3,
    ),
    # Bonds that grow at rest shortly after they form: with uniform strips 121.
    "fast growth": (Bonds(1.0, 1.0, -0.9, "report", 0.5, BondGrowth(0.1, 0.02, 2e-5), 0.0), WALK, 800, 1e-3),
    # The bond length falls by three quarters within 0.01: with the weight of merged strips taken as uniform 5.2.
    "shrinking": (
        Bonds(1.0, 1.0, 0.3, "stretch", 0.24, BondGrowth(0.15, 6.6e-3, 2e-3), 0.0),
        0.046 * random_walk(3, 1000, 0.05), 400, 2e-4,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_always_merging_stays_within_stated_error(name):
    """Merging stays within its stated error where it is difficult."""
    assert compare_merged_with_full(*CASES[name]) < 1


ORDERS = {"report": [-0.9, -0.5, 0, 0.3, 0.5, 1, 1.5, 2, 3.3], "stretch": [0, 0.3, 0.5, 2, 3.3]}


def draw_law_path_and_steps(rng):
    """Return a random law, path and number of steps per cycle."""
    reading = str(rng.choice([*ORDERS]))
    steps = int(rng.choice([30, 100, 400]))
    amplitude = 10 ** rng.uniform(-2.5, 0.7)
    order = float(rng.choice(ORDERS[reading]))
    phase = np.arange(min(8 * steps, 1500) + 1) / steps * 2 * np.pi
    paths = (
        np.sin(phase),
        np.sin(phase) + 0.3 * np.sin(8.1 * phase),
        np.clip(1.3 * np.sin(phase), -1, 1),
        np.exp(-phase / 6) * np.sin(phase + 1) - np.sin(1),
        random_walk(int(rng.integers(1e6)), phase.size - 1, 1 / np.sqrt(steps)),
    )
    path = amplitude * paths[rng.integers(5)]
    growth = {}
    if rng.random() >= 0.4:
        growth = {
            "ratio": rng.uniform(0.2, 1),
            "growth": BondGrowth(
                amplitude * 10 ** rng.uniform(-3, 2),
                10 ** rng.uniform(-2.5, 1),
                amplitude * 10 ** rng.uniform(-4, -1),
            ),
        }
    initial = float(order >= 0 and rng.random() < 0.5)
    return Bonds(1.0, 1.0, order, reading, initial=initial, **growth), path, steps


@pytest.mark.parametrize("count", [4, pytest.param(60, marks=pytest.mark.slow)])
def test_always_merging_stays_within_stated_error_on_random_paths(count):
    """The error of merging is below the stated error on random laws and paths."""
    rng = np.random.default_rng(4)
    ratios = [
        compare_merged_with_full(*draw_law_path_and_steps(rng), 10 ** rng.uniform(-4, -2))
        for _ in range(count)
    ]
    assert max(ratios) < 1


@pytest.mark.parametrize("growth", [{}, GROWTH])
@pytest.mark.parametrize("reading, order", [("report", 2.0), ("stretch", 0.5)])
def test_exact_merged_strips_of_long_strokes(reading, order, growth):
    """On long strokes in fine steps the merged list has the forces and energies of all bonds."""
    law = Bonds(1.0, 1.0, order, reading, initial=0.0, **growth)
    path = triangle_path(4.0, 2, 400)
    full = follow_list(law, path, 0.0075)
    merged = follow_list(law, path, 0.0075, 1e-9, 0.02)
    bound = 6.0 if growth and reading == "report" else 1.0
    assert merged.forces[:, 0] == pytest.approx(full.forces[:, 0], abs=bound * 0.02**2)
    assert merged.energies[:, 1] == pytest.approx(full.energies[:, 1], abs=bound * 0.02**2)
