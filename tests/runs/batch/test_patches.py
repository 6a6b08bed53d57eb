"""Static patches pressed together, held against their own single runs: values, bars, warnings and notes."""

from pathlib import Path

import numpy as np
import pytest
from scene_texts import COATING, PIECE

from patchfem import build
from patchfem.campaigns import Cases, SweepScene
from patchfem.campaigns.sweeps.executors import LocalExecutor
from patchfem.export import compute_in_memory
from patchfem.runs import solve_with_coarser, with_shared_meshes
from patchfem.runs.batch import batches, one_by_one, patches
from patchfem.runs.patch.grids import contact_extent
from patchfem.scene import make_axis, scene

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
CROWN = '[contact.crown]\nradius = "2 m"\n'
HOLDER = '[contact.holder]\nrotational_stiffness = "100 N m/rad"\n'
PEAK = 1e-11  # of the pressure at an end of bare pieces, the mean over a cell of a micron: 1.5e-12 was seen
PINNED = 'element_size = "0.2 mm"\n'  # no mesh has to be chosen


def family(tables, *values, loads=(100.0, 600.0), size=PINNED):
    texts = [TEXT.format(size, load, tables.format(value)) for value in values for load in loads]
    return with_shared_meshes([build(scene.loads(text)) for text in texts])


def same(models, together=None):
    """Answers of both ways; every case is held against its own run."""
    if together is None:
        messages = []
        mine = batches.solve_models(models, say=messages.append)
        assert not any("run one by one" in message for message in messages), messages
    else:
        mine = together(models)
    single = one_by_one.solve(models)
    assert mine.outcome.tolist() == single.outcome.tolist()
    assert (mine.warnings, mine.notes, mine.numerics, mine.units) == (
        single.warnings,
        single.notes,
        single.numerics,
        single.units,
    )
    for name, values in single.values.items():
        near = PEAK if name in ("pressure_peak", "loaded_fraction") else 1e-12
        # the larger terms that a value is the difference of
        size = np.abs(values) + single.floors[name]
        if name == "rotation":  # the closings of both ends, over the length
            size = size + np.abs(single.values["approach"]) / models[0].patch.pieces.length
        for column, wanted in (
            (mine.values, values),
            (mine.errors, single.errors[name]),
            (mine.floors, single.floors[name]),
        ):
            assert (np.abs(column[name] - wanted) <= near * size).all(), name
    return mine


@pytest.mark.parametrize(
    ("tables", "values"),
    [
        (TILT, (-2e-4, 0.0, 1e-5, 1e-4)),
        (TILT + SKIN, (-1e-4, 1e-5, 2e-4)),
        (LINE, (-5e-3, -1e-3, 3e-3)),
        (TILT + HOLDER, (1e-5, -2e-4)),
    ],
)
def test_exact_together_as_one_by_one(tables, values):
    models = family(tables, *values)
    assert all(patches.refuses(model) == "" for model in models)
    assert all(
        one is not None
        for one in patches.static_batch.solve_alike_patches([model.patch for model in models], 1e-2)
    )
    same(models)


def test_exact_together_as_one_by_one_on_a_mesh_chosen_for_them():
    same(family(TILT + SKIN, -1e-4, 1e-3, loads=(100.0,), size=""))


def test_exact_cases_of_every_kind_beside_each_other():
    """Skins, tolerances, tilts and load lines that no group may mix; pieces so tall and pressed so hard that a single
    run says so, and keys without a use."""
    soft = SKIN.replace("1e14", "1e13")
    parts = [
        (TILT.format(1e-4), ""),
        (TILT.format(2e-4) + SKIN, ""),
        (TILT.format(1e-4) + soft, ""),
        (LINE.format(3e-3), ""),
        (LINE.format(-2e-3), "pairs = 2\n"),
    ]
    texts = [
        TEXT.format(PINNED + more, load, tables)
        for tables, more in parts
        for load in (100.0, 600.0)
    ]
    tall = TEXT.format(PINNED + "pairs = 2\n", 2e7, TILT.format(1e-3)).replace(
        '"6.35 mm"', '"38.1 mm"'
    )
    texts += [text.replace("1e-2", "1e-5") for text in texts[:2]] + [
        tall,
        tall.replace("2e7", "2e6"),
    ]
    texts.append(texts[0] + 'quadrature = "merged"\n')
    mine = same(with_shared_meshes([build(scene.loads(text)) for text in texts]))
    said = [
        " ".join(mine.warnings.get(case, []) + mine.notes.get(case, []))
        for case in range(len(texts))
    ]
    for part in (
        "beyond the small strains",
        "times as tall as it is",
        "accuracy.quadrature = 'merged' has no meaning",
    ):
        assert any(part in one for one in said), part


@pytest.mark.parametrize("tables", [TILT, TILT + SKIN])
def test_exact_patches_solved_together_are_those_of_their_own(tables):
    """What moves a patch takes of it: pressure, gap, compliance, and the rest that the pressed patch carries."""
    models = family(tables, -1e-4, 1e-5, 3e-4)
    for model, other in zip(models, patches.press_together(models)):
        assert model.patch.solved is None and other.patch.solved is not None
        for mine, own in zip(other.patch.solved.patches, solve_with_coarser(model.patch, 1e-2)):
            top = own.pressure.sigma_n.max()
            assert np.abs(mine.pressure.sigma_n - own.pressure.sigma_n).max() < 1e-11 * top
            np.testing.assert_array_equal(mine.active, own.active)
            np.testing.assert_array_equal(mine.unloaded_gap, own.unloaded_gap)
            np.testing.assert_array_equal(mine.giving, own.giving)
            assert mine.pressure.gap == pytest.approx(
                own.pressure.gap, rel=1e-9, abs=1e-9 * np.ptp(own.unloaded_gap)
            )
            for name in ("approach", "rotation", "load", "moment"):
                assert getattr(mine.pressure, name) == pytest.approx(
                    getattr(own.pressure, name), rel=1e-11
                )
            assert contact_extent(mine).places == pytest.approx(
                contact_extent(own).places, rel=1e-9
            )


def test_exact_a_sweep_in_columns_is_that_of_its_models():
    """The cases of a sweep are one model with columns of numbers; here the same as models of their own."""
    values = [(-4.5, 2.0, 300.0), (-3.2, 0.4, 700.0), (-3.9, 20.0, 90.0)]
    text = TEXT.format(PINNED, 100.0, TILT.format(1e-4) + CROWN)
    keys = {
        "contact.tilt.angle": [f"{10**a!r} rad" for a, _, _ in values],
        "contact.crown.radius": [f"{r!r} m" for _, r, _ in values],
        "contact.load": [f"{load!r} N" for _, _, load in values],
    }
    cases = Cases(tuple(make_axis(key, texts, distinct=False) for key, texts in keys.items()), True)
    found = compute_in_memory(SweepScene(Path("patch.toml"), text), cases, LocalExecutor())
    models = with_shared_meshes(
        [
            build(scene.loads(text, sets=[f"{key}={texts[k]}" for key, texts in keys.items()]))
            for k in range(3)
        ]
    )
    wanted = batches.solve_models(models)
    for name, column in wanted.values.items():
        for mine, other in (
            (found.values[name], column),
            (found.errors[name], wanted.errors[name]),
        ):
            assert mine == pytest.approx(other, rel=1e-12), name


def test_refuses_a_profile_to_be_pressed_with_others(tmp_path):
    """What it is averaged over stands in its own bars."""
    (tmp_path / "waves.csv").write_text(
        "x [mm],z [um]\n" + "".join(f"{0.1 * k},{k % 3}\n" for k in range(-70, 71))
    )
    text = TEXT.format(PINNED, 100.0, '[contact.profile]\nfile = "waves.csv"\n')
    models = with_shared_meshes(
        [build(scene.loads(text, tmp_path / "patch.toml")) for _ in range(2)]
    )
    assert "profile" in patches.refuses(models[0])


def test_refuses_what_is_not_pressed_together():
    lonely = build(scene.loads(TEXT.format("", 100.0, TILT.format(1e-4))))
    assert "its own" in patches.refuses(lonely)
    assert (
        patches.refuses(
            family(
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
