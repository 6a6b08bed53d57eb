"""Patches with bonds and shear, reduced to a few points, agree with single runs of the full
patches."""

import re
from dataclasses import replace

import numpy as np
from scene_texts import COATED, MODE, SECOND, SHEAR

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, gathered, one_by_one

BONDS = '[friction]\nlaw = "nonlocal"\nreading = "stretch"\nstatic = 0.3\nkinetic = 0.3\nbond_length = "1 um"\n'
DRIVE = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n'
FREE_MESH = COATED.replace('element_size = "0.5 mm"\n', "")
SCENE = (
    FREE_MESH
    + '[contact.tilt]\nangle = "0.02 mrad"\n'
    + SHEAR
    + BONDS
    + MODE
    + SECOND
    + DRIVE
    + "[accuracy]\ntolerance = 1e-2\nsteps_per_cycle = 200\n"
)
# Fraction of the sum of both errors that a typical difference must not exceed.
TYPICAL_FRACTION = 0.1


def draw_models(seed: int, count: int) -> list:
    """Return models with random tilts, loads, friction coefficients and drive levels on shared
    meshes."""
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


def count_deviations(reduced, full) -> tuple:
    """Return the number of values, of those that differ by more than TYPICAL_FRACTION times the sum
    of both errors and floors, and of those that differ by more than the whole sum."""
    differences = []
    limits = []
    for name, column in reduced.values.items():
        difference = np.abs(column - full.values[name])
        difference = (
            np.minimum(difference, np.pi - difference) if name == "slip_start_phase" else difference
        )
        is_number = ~np.isnan(difference)
        assert (np.isnan(column) == np.isnan(full.values[name])).all(), name
        differences.append(difference[is_number])
        limits.append(
            (np.nan_to_num(reduced.errors[name] + full.errors[name]) + reduced.floors[name])[
                is_number
            ]
        )
    differences = np.concatenate(differences)
    limits = np.concatenate(limits)
    return (
        differences.size,
        int((differences > TYPICAL_FRACTION * limits + 1e-300).sum()),
        int((differences > limits + 1e-300).sum()),
    )


def compare_with_single_runs(seed: int, count: int) -> tuple:
    """Solve random cases in a batch and one by one; return the counts of `count_deviations`."""
    cases = draw_models(seed, count)
    assert all(
        batches.choose_batch(case, 32).name == "gathered" and batches.choose_batch(case, 31) is None
        for case in cases
    )
    reduced = gathered.solve(cases)
    full = one_by_one.solve(cases)
    assert (reduced.outcome == full.outcome).all() and not reduced.messages
    assert remove_error_sizes(reduced.warnings) == remove_error_sizes(full.warnings)
    return count_deviations(reduced, full)


def remove_error_sizes(warnings: dict) -> dict:
    """Return warnings by case without the sizes of errors, which depend on the last digits of
    values."""
    return {
        case: [re.sub(r"error of \S+", "error", text) for text in texts]
        for case, texts in warnings.items()
    }


def test_always_reduced_patches_agree_within_errors():
    """Measures of patches reduced to a few points agree with those of the full patches within the
    sum of both errors; at most 3 % differ by more than a tenth of this sum."""
    count, above_tenth, beyond_errors = compare_with_single_runs(1, 2)
    assert count > 40 and beyond_errors == 0 and above_tenth <= 0.03 * count


def test_always_measured_table_prevents_batch_only_if_unreadable(tmp_path):
    """A scene with a table of measured responses is solved in a batch; if the table cannot be read,
    the case fails with a message that names the file."""
    table = tmp_path / "rows.csv"
    table.write_text("frequency [Hz],input [g],displacement [mil],flag\n143,5,0.4,\n")
    with_table = pf.build(SCENE + f'[measured]\nfile = "{table}"\n')
    assert gathered.reason_not_in_lanes(with_table) == ""
    without_table = replace(
        with_table, measured=with_table.measured._replace(path=tmp_path / "none.csv")
    )
    assert "table of measured responses cannot be read" in gathered.reason_not_in_lanes(
        without_table
    )
    results = batches.solve_models([without_table], n_study_cases=32)
    assert "none.csv" in results.messages[0]


def test_always_stuck_or_unfilled_bonds_agree_with_single_runs():
    """A case that sticks on its bonds, and a case with half of the initial bonds, have the outcomes
    and measures of single runs."""
    stuck = pf.build(SCENE, **{"drive.acceleration": 1e-4})
    half_bonds = pf.build(SCENE, **{"friction.initial_bonds": 0.5})
    assert gathered.group_key(half_bonds) is None and gathered.group_key(stuck) is not None
    for model in (stuck, half_bonds):
        cases = with_shared_meshes([model, model])[:1]
        batch = gathered.solve(cases)
        single = one_by_one.solve(cases)
        assert (batch.outcome == single.outcome).all() and count_deviations(batch, single)[2] == 0
