"""Patches with bonds behind shear, few points in place of all their nodes, beside the same cases run by themselves."""

import re
from dataclasses import replace

import numpy as np
from scene_texts import COATED, MODE, SECOND, SHEAR

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, gathered, one_by_one

BONDS = '[friction]\nlaw = "nonlocal"\nreading = "stretch"\nstatic = 0.3\nkinetic = 0.3\nbond_length = "1 um"\n'
DRIVE = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n'
FREE = COATED.replace('element_size = "0.5 mm"\n', "")
SCENE = (
    FREE
    + '[contact.tilt]\nangle = "0.02 mrad"\n'
    + SHEAR
    + BONDS
    + MODE
    + SECOND
    + DRIVE
    + "[accuracy]\ntolerance = 1e-2\nsteps_per_cycle = 200\n"
)
NARROW = 0.1  # of the sum of both bars


def models(seed: int, count: int) -> list:
    """Random tilts, loads, frictions and levels, on meshes that they share."""
    r = np.random.default_rng(seed)
    return with_shared_meshes(
        [
            pf.build(
                SCENE,
                **{
                    "contact.tilt.angle": float(10 ** r.uniform(-5, -3)),
                    "contact.load": float(10 ** r.uniform(1.2, 2.0)),
                    "friction.static": (static := float(r.uniform(0.15, 0.45))),
                    "friction.kinetic": static,
                    "drive.acceleration": float(9.81 * 10 ** r.uniform(0.3, 1)),
                },
            )
            for _ in range(count)
        ]
    )


def beside(found, real) -> tuple:
    """(values compared, those apart by more than NARROW of the sum of both bars and floors, beyond all of it)."""
    apart = []
    bars = []
    for name, column in found.values.items():
        gap = np.abs(column - real.values[name])
        gap = np.minimum(gap, np.pi - gap) if name == "slip_start_phase" else gap
        there = ~np.isnan(gap)
        assert (np.isnan(column) == np.isnan(real.values[name])).all(), name
        apart.append(gap[there])
        bars.append(
            (np.nan_to_num(found.errors[name] + real.errors[name]) + found.floors[name])[there]
        )
    apart = np.concatenate(apart)
    bars = np.concatenate(bars)
    return (
        apart.size,
        int((apart > NARROW * bars + 1e-300).sum()),
        int((apart > bars + 1e-300).sum()),
    )


def held(seed: int, count: int) -> tuple:
    cases = models(seed, count)
    assert all(
        batches.choose_batch(one, 32).name == "gathered" and batches.choose_batch(one, 31) is None
        for one in cases
    )
    found = gathered.solve(cases)
    real = one_by_one.solve(cases)
    assert (found.outcome == real.outcome).all() and not found.messages
    assert without_sizes(found.warnings) == without_sizes(real.warnings)
    return beside(found, real)


def without_sizes(warnings: dict) -> dict:
    """Warnings by case without the sizes of errors, which hang on the last digits of values."""
    return {
        case: [re.sub(r"error of \S+", "error", text) for text in texts]
        for case, texts in warnings.items()
    }


def test_always_few_points_are_within_the_bars_of_all():
    count, wide, outside = held(1, 2)
    assert count > 40 and outside == 0 and wide <= 0.03 * count


def test_a_table_of_measured_responses_keeps_no_batch_away_unless_it_cannot_be_read(tmp_path):
    table = tmp_path / "rows.csv"
    table.write_text("frequency [Hz],input [g],displacement [mil],flag\n143,5,0.4,\n")
    beside = pf.build(SCENE + f'[measured]\nfile = "{table}"\n')
    assert gathered.why_no_lanes(beside) == ""
    lost = replace(beside, measured=beside.measured._replace(path=tmp_path / "none.csv"))
    assert "table of measured responses cannot be read" in gathered.why_no_lanes(lost)
    found = batches.solve_models([lost], study=32)
    assert "none.csv" in found.messages[0]


def test_always_what_lanes_do_not_take_runs_by_itself():
    """A case that its bonds hold, and one whose bonds do not fill their places at first."""
    held_fast = pf.build(SCENE, **{"drive.acceleration": 1e-4})
    fewer = pf.build(SCENE, **{"friction.initial_bonds": 0.5})
    assert gathered.group(fewer) is None and gathered.group(held_fast) is not None
    for one in (held_fast, fewer):
        cases = with_shared_meshes([one, one])[:1]
        found = gathered.solve(cases)
        real = one_by_one.solve(cases)
        assert (found.outcome == real.outcome).all() and beside(found, real)[2] == 0
