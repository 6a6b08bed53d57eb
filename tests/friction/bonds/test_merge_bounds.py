"""The stated error of merging, `engines.EngineChoice.error`, against the list of every bond: forces and step means of any
path and law, growing bonds and small strokes among them."""

import numpy as np
import pytest
from friction_paths import random_walk
from list_paths import STATUS, follow_list

from patchfem.friction import Bonds, RequestedEngine, choose_engine

MERGED = RequestedEngine("merged")
GROWN = {"ratio": 0.54, "rest_growth": 0.145, "slip_growth": 7.64, "rest_speed": 4.55e-4}


def share(law, path, steps, tolerance):
    """Largest error of merging over the stated one, and the strips kept of those there are."""
    moves = np.diff(path)
    way = np.sign(moves[moves != 0])
    strokes = 1 + np.count_nonzero(way[1:] != way[:-1])
    dt = 2 * np.pi / steps
    chosen = choose_engine(
        law, tolerance, np.abs(moves).sum() / strokes, max(way.size / strokes, 1), MERGED
    )
    whole = follow_list(law, path, dt)
    got = follow_list(law, path, dt, chosen.merge, chosen.tail)
    moved = np.abs(moves) > 1e-9 * np.abs(moves).max()
    off = max(np.abs(got.after - whole.after).max(), np.abs(got.mean - whole.mean)[moved].max())
    return off / chosen.error, got.status[STATUS.max_strips] / whole.status[STATUS.max_strips]


def test_always_step_means_of_merged_bonds_keep_the_bound_where_forces_jump():
    """Bonds of order 0, their stored energy continuous as the slide comes to a merged strip: with a strip taken as even
    from there on it jumped, and means over short steps were 2.2 times the bound off."""
    turn = np.arange(6 * 400 + 1) / 400 * 2 * np.pi
    path = 0.192 * np.clip(1.3 * np.sin(turn), -1, 1)
    off, kept = share(Bonds(1.0, 1.0, 0.0, initial=0.0, **GROWN), path, 400, 4e-3)
    assert off < 1 and kept < 0.2


@pytest.mark.parametrize("order", [-0.5, -0.8, 0.3])
def test_always_young_bonds_of_fractional_order_are_not_spread_evenly(order):
    """A decay far below the merge width: R^p is steep in young bonds, and strokes taken as even were 6 times the bound
    off."""
    turn = np.arange(6 * 400 + 1) / 400 * 2 * np.pi
    path = 0.00536 * (np.exp(-turn / 6) * np.sin(turn + 1) - np.sin(1))
    assert share(Bonds(1.0, 1.0, order, "report", initial=0.0), path, 400, 2.9e-3)[0] < 1


@pytest.mark.parametrize("order, seed", [(-0.9, 1), (-0.9, 4), (-0.5, 1)])
def test_always_bonds_that_grow_fast_at_a_rest_are_not_spread_evenly_while_young(order, seed):
    """Grown within a step, a millionth of a bond length after they formed: R^p is steep in them still, and places taken
    as even were 121, 18 and 9 times the bound off."""
    path = np.interp(np.arange(481) / 8, np.arange(61), 0.01 * random_walk(seed, 60, 0.1))
    law = Bonds(1.0, 1.0, order, "report", 0.5, 0.1, 0.02, 2e-5, 0.0)
    assert share(law, path, 800, 1e-3)[0] < 1


@pytest.mark.share(1)
@pytest.mark.parametrize("order", [0.1, 0.3, 0.5])
def test_always_stretched_bonds_whose_length_falls_at_once_keep_the_bound(order):
    """Lengths that fall by three quarters within 0.01: the weight of joined strips, taken as even, moved over to where
    the slide was turning, up to 5.2 times the bound."""
    law = Bonds(1.0, 1.0, order, "stretch", 0.24, 0.15, 6.6e-3, 2e-3, 0.0)
    assert share(law, 0.046 * random_walk(3, 1500, 0.05), 400, 2e-4)[0] < 1


ORDERS = {"report": [-0.9, -0.5, 0, 0.3, 0.5, 1, 1.5, 2, 3.3], "stretch": [0, 0.3, 0.5, 2, 3.3]}


def drawn(rng):
    """(law, path, steps per cycle) by chance."""
    reading = str(rng.choice([*ORDERS]))
    steps = int(rng.choice([30, 100, 400]))
    size = 10 ** rng.uniform(-2.5, 0.7)
    order = float(rng.choice(ORDERS[reading]))
    turn = np.arange(min(8 * steps, 1500) + 1) / steps * 2 * np.pi
    path = (
        size
        * (
            np.sin(turn),
            np.sin(turn) + 0.3 * np.sin(8.1 * turn),
            np.clip(1.3 * np.sin(turn), -1, 1),
            np.exp(-turn / 6) * np.sin(turn + 1) - np.sin(1),
            random_walk(int(rng.integers(1e6)), turn.size - 1, 1 / np.sqrt(steps)),
        )[rng.integers(5)]
    )
    grown = (
        {}
        if rng.random() < 0.4
        else {
            "ratio": rng.uniform(0.2, 1),
            "rest_growth": size * 10 ** rng.uniform(-3, 2),
            "slip_growth": 10 ** rng.uniform(-2.5, 1),
            "rest_speed": size * 10 ** rng.uniform(-4, -1),
        }
    )
    return (
        Bonds(1.0, 1.0, order, reading, initial=float(order >= 0 and rng.random() < 0.5), **grown),
        path,
        steps,
    )


def worst_of(seed, count):
    rng = np.random.default_rng(seed)
    return max(share(*drawn(rng), 10 ** rng.uniform(-4, -2))[0] for _ in range(count))


def test_always_merging_keeps_its_bound_on_15_random_paths():
    assert worst_of(4, 15) < 1
