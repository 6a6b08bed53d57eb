"""Static patches that are pressed together agree with single runs in values, errors, warnings and
notes."""

import numpy as np
import pytest
from scene_texts import COATING, PIECE

from patchfem import build
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, one_by_one, patches
from patchfem.scene import scene

TEXT = (
    PIECE
    + '{}load = "{} N"\nsubstrate = "Ti-8Al-1Mo-1V"\n'
    + COATING
    + "{}\n[accuracy]\ntolerance = 1e-2\n"
)
TILT, LINE = '[contact.tilt]\nangle = "{} rad"\n', '[contact.load_line]\noffset = "{} m"\n'
SKIN = (
    '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e14 Pa/m"\ntangential_ratio = 0.8\n'
)
HOLDER = '[contact.holder]\nrotational_stiffness = "100 N m/rad"\n'
# Relative tolerance of the end pressure of uncoated pieces, a mean over a cell of 1 um (largest
# difference seen: 1.5e-12).
PEAK_TOLERANCE = 1e-11
# A given element size, so that no mesh is chosen automatically.
FIXED_SIZE = 'element_size = "0.2 mm"\n'


def build_family(tables, *values, loads=(100.0, 600.0), size=FIXED_SIZE):
    """Return models on shared meshes for all values of the tables and all loads."""
    texts = [TEXT.format(size, load, tables.format(value)) for value in values for load in loads]
    return with_shared_meshes([build(scene.loads(text)) for text in texts])


def assert_equal_to_single_runs(models, solve_together=None):
    """Solve models together and one by one, assert that all results agree, and return the former.

    `together` solves the models together; by default this is the program's choice of batch.
    """
    if solve_together is None:
        messages = []
        results = batches.solve_models(models, report=messages.append)
        assert not any("run one by one" in message for message in messages), messages
    else:
        results = solve_together(models)
    single = one_by_one.solve(models)
    assert results.outcome.tolist() == single.outcome.tolist()
    assert (results.warnings, results.notes, results.numerics, results.units) == (
        single.warnings,
        single.notes,
        single.numerics,
        single.units,
    )
    for name, values in single.values.items():
        tolerance = PEAK_TOLERANCE if name in ("pressure_peak", "loaded_fraction") else 1e-12
        # Size of the terms whose difference is the value.
        magnitude = np.abs(values) + single.floors[name]
        if name == "rotation":  # Difference of the approaches of both ends, divided by the length.
            magnitude = (
                magnitude + np.abs(single.values["approach"]) / models[0].patch.pieces.length
            )
        for column, expected in (
            (results.values, values),
            (results.errors, single.errors[name]),
            (results.floors, single.floors[name]),
        ):
            assert (np.abs(column[name] - expected) <= tolerance * magnitude).all(), name
    return results


@pytest.mark.parametrize(
    ("tables", "values"),
    [
        (TILT, (-2e-4, 0.0, 1e-5, 1e-4)),
        (TILT + SKIN, (-1e-4, 1e-5, 2e-4)),
        (TILT + HOLDER, (1e-5, -2e-4)),
    ],
)
def test_exact_patches_pressed_together_agree_with_single_runs(tables, values):
    """Patches with different tilts, skins, load lines or holders that are pressed together agree with single runs."""
    models = build_family(tables, *values)
    assert all(patches.refusal_reason(model) == "" for model in models)
    assert all(
        patch is not None
        for patch in patches.static_batch.solve_similar_patches(
            [model.patch for model in models], 1e-2
        )
    )
    assert_equal_to_single_runs(models)


def test_exact_patches_on_automatic_mesh_agree_with_single_runs():
    """Patches that are pressed together on a shared automatic mesh agree with single runs."""
    assert_equal_to_single_runs(build_family(TILT + SKIN, -1e-4, 1e-3, loads=(100.0,), size=""))


def test_exact_mixed_patches_agree_with_single_runs():
    """Cases with different skins, tolerances, tilts and load lines, which cannot share a group,
    agree with single runs. Warnings about tall pieces and large strains, and notes about keys
    without meaning, are kept."""
    soft_skin = SKIN.replace("1e14", "1e13")
    tables_and_keys = [
        (TILT.format(1e-4), ""),
        (TILT.format(2e-4) + SKIN, ""),
        (TILT.format(1e-4) + soft_skin, ""),
        (LINE.format(3e-3), ""),
        (LINE.format(-2e-3), "pairs = 2\n"),
    ]
    texts = [
        TEXT.format(FIXED_SIZE + keys, load, tables)
        for tables, keys in tables_and_keys
        for load in (100.0, 600.0)
    ]
    tall = TEXT.format(FIXED_SIZE + "pairs = 2\n", 2e7, TILT.format(1e-3)).replace(
        '"6.35 mm"', '"38.1 mm"'
    )
    texts += [text.replace("1e-2", "1e-5") for text in texts[:2]] + [
        tall,
        tall.replace("2e7", "2e6"),
    ]
    texts.append(texts[0] + 'quadrature = "merged"\n')
    results = assert_equal_to_single_runs(
        with_shared_meshes([build(scene.loads(text)) for text in texts])
    )
    texts_by_case = [
        " ".join(results.warnings.get(case, []) + results.notes.get(case, []))
        for case in range(len(texts))
    ]
    for part in (
        "beyond the small strains",
        "times as tall as it is",
        "accuracy.quadrature = 'merged' has no meaning",
    ):
        assert any(part in line for line in texts_by_case), part


def test_refuses_own_mesh_or_hertz_skin_in_patch_batch():
    """A patch with a mesh of its own, or with a nonlinear skin, is not pressed together with
    others."""
    own_mesh = build(scene.loads(TEXT.format("", 100.0, TILT.format(1e-4))))
    assert "its own" in patches.refusal_reason(own_mesh)
    assert (
        patches.refusal_reason(
            build_family(
                TILT
                + SKIN.replace("linear", "hertz").replace(
                    'normal_stiffness = "1e14 Pa/m"',
                    'radius = "50 um"\ndensity = "1e9 1/m^2"\nheight_deviation = "1 um"',
                ),
                1e-4,
            )[0]
        )
        == "strips or a smooth skin lie between the pieces"
    )
