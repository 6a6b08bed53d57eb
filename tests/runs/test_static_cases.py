"""Static patches as cases of a group agree with single runs of each of them."""

from dataclasses import replace

import numpy as np
import pytest
from scene_runs import load_scene
from scene_texts import BLOCK, COATING

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.runs import patch as folder

TOLERANCE = 1e-3
TILT = '[contact.tilt]\nangle = "0.02 mrad"\n'
STEP = '[contact.step]\nheight = "0.2 um"\nat = "2 mm"\n'
SKIN = '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e14 Pa/m"\n'
UNLIKE = '[contact.upper]\nsubstrate = {young = "70 GPa", poisson = 0.3, density = "2700 kg/m^3"}\n'
SOFT_LAYER = '[contact.asperities]\nlaw = "exponential"\ndecay_length = "0.3 um"\n'
ROUND = TILT + '[contact.lower]\nend_radius = "3 mm"\n[contact.upper]\nend_radius = "3 mm"\n'
LOADS = np.array([20.0, 60.0, 180.0, 540.0])
ANGLES = np.array([1e-5, -2e-5, 8e-5, 2e-4])


def make_group(text: str):
    """Return the patch model of a scene with LOADS and, if it has a tilt, ANGLES."""
    patch = pf.build(load_scene(text)).patch.with_loading(load=LOADS)
    shapes = tuple(
        (name, keys.model_copy(update={"angle": ANGLES} if name == "tilt" else {}))
        for name, keys in patch.gap.shapes
    )
    return replace(patch, gap=replace(patch.gap, shapes=shapes))


def list_single_runs(group, tolerance: float = TOLERANCE) -> list:
    """Return the measures of a single run of each case."""
    runs = (
        folder.case_meshes.solve_with_coarser(folder.cases.take_patch(group, case), tolerance)
        for case in range(LOADS.size)
    )
    return [patches[0].measures for patches in runs]


@pytest.mark.parametrize(
    "extra, tolerance",
    [
        *((TILT + extra, TOLERANCE) for extra in ("", STEP, SKIN, UNLIKE, SOFT_LAYER)),
        (ROUND, 1e-2),
        pytest.param(ROUND, TOLERANCE, marks=pytest.mark.slow),
    ],
)
def test_always_cases_agree_with_single_runs_within_errors(extra, tolerance):
    """Values differ by less than both errors, and every case meets the tolerance."""
    group = make_group(BLOCK + COATING + extra)
    batch = folder.case_meshes.solve_cases(group, LOADS.size, tolerance)
    assert batch.outcome.tolist() == [folder.cases.OutcomeCode.DONE] * LOADS.size
    assert batch.excess.max() <= 1
    for case, measures in enumerate(list_single_runs(group, tolerance)):
        assert measures.keys() == batch.values.keys()
        for name, measure in measures.items():
            if measure.value is None:
                assert np.isnan(batch.values[name][case])
                continue
            allowed = measure.error + batch.errors[name][case]
            assert abs(batch.values[name][case] - measure.value) <= allowed, (name, case)


def test_always_rotation_has_the_error_of_the_moment():
    """Holders without tilt do not turn; on the mesh of tilted ones their rotation is 0 within its error, and allowed."""
    crown = (
        '[contact.crown]\nradius = "3 m"\n[contact.holder]\nrotational_stiffness = "300 N m/rad"\n'
    )
    group = make_group(BLOCK + TILT + crown)
    keys = {"angle": np.array([0.0, 0.0, 1e-4, -3e-5])}
    shapes = [
        (name, table.model_copy(update=keys if name == "tilt" else {}))
        for name, table in group.gap.shapes
    ]
    group = replace(group, gap=replace(group.gap, shapes=tuple(shapes)))
    batch = folder.case_meshes.solve_cases(group, LOADS.size, TOLERANCE)
    assert batch.excess.max() <= 1
    value, error, moment = (
        batch.values["rotation"],
        batch.errors["rotation"],
        batch.errors["moment"],
    )
    assert (np.abs(value) <= error)[:2].all() and (value[:2] != 0).all()
    # A moment at the holder turns its spring and the contact
    stiffness = 300 + batch.values["rotational_stiffness"][:2]
    assert (error[:2] >= 0.99 * moment[:2] / stiffness).all()


@pytest.mark.parametrize("extra", [TILT, TILT + STEP, TILT + SKIN, TILT + UNLIKE])
def test_exact_cases_agree_with_single_runs_on_the_same_mesh(extra):
    """On a mesh that the scene prescribes, values, errors and floors are those of single runs to 1e-9."""
    group = make_group(BLOCK + COATING + extra).with_element_size(0.15e-3)
    batch = folder.case_meshes.solve_cases(group, LOADS.size, TOLERANCE)
    for case, measures in enumerate(list_single_runs(group)):
        for name, measure in measures.items():
            value = np.nan if measure.value is None else measure.value
            error = np.nan if measure.error is None else measure.error
            floor = measure.floor
            size = 1e-9 * abs(np.nan_to_num(value)) + 1e-6 * floor
            np.testing.assert_allclose(batch.values[name][case], value, rtol=0, atol=size)
            np.testing.assert_allclose(
                batch.errors[name][case], error, rtol=1e-6, atol=10 * size, err_msg=name
            )
            np.testing.assert_allclose(batch.floors[name][case], floor, rtol=1e-6)


@pytest.mark.parametrize("extra", [TILT, TILT + STEP, SOFT_LAYER])
def test_exact_single_run_is_a_batch_of_one(extra):
    """A group with a single case has the meshes, and so the values, errors and floors, of the single run to 1e-12."""
    patch = pf.build(load_scene(BLOCK + COATING + extra)).patch
    batch = folder.case_meshes.solve_cases(patch, 1, TOLERANCE)
    single = folder.case_meshes.solve_with_coarser(patch, TOLERANCE)[0]
    assert batch.facts[folder.cases.MeshFact.N_NODES, 0] == single.x.size
    for name, measure in single.measures.items():
        columns = (batch.values, batch.errors, batch.floors)
        found = [column[name][0] for column in columns]
        assert found == pytest.approx(
            [measure.value, measure.error, measure.floor], rel=1e-12, nan_ok=True
        )


def test_always_failed_case_does_not_stop_the_others():
    """A load that cannot be computed with is refused with its error, and the other cases have their values."""
    group = make_group(BLOCK + COATING + TILT)
    loads = LOADS.copy()
    loads[1] = 1e-250
    loads[2] = 0.0
    batch = folder.case_meshes.solve_cases(group.with_loading(load=loads), LOADS.size, TOLERANCE)
    expected = [
        folder.cases.OutcomeCode.DONE,
        folder.cases.OutcomeCode.FAILED,
        folder.cases.OutcomeCode.NO_CONTACT,
        folder.cases.OutcomeCode.DONE,
    ]
    assert batch.outcome.tolist() == expected
    assert isinstance(batch.messages[1], PatchfemError) and batch.messages.keys() == {1}
    assert np.isnan(batch.values["pressure_peak"][1])
    assert batch.excess[[0, 3]].max() <= 1


@pytest.mark.parametrize("springs", [[0.0, 0.0], [1e-6, 1e-2], [1e-6, 1e6]])
def test_exact_holders_of_a_group_are_those_of_each_case(springs):
    """A case has the same load, approach, moment and spring in a group as alone, with springs of any stiffness."""
    patch = pf.build(load_scene(BLOCK + COATING + TILT)).patch
    group = patch.with_loading(load=LOADS[:2], rotational_stiffness=np.array(springs))
    holders = folder.cases.make_cases(group, 2).holders
    for case in range(2):
        alone = folder.cases.make_cases(folder.cases.take_patch(group, case), 1).holders
        for name in ("load", "approach", "moment", "spring"):
            found, expected = getattr(holders, name)[case], getattr(alone, name)[0]
            assert found == expected or (np.isnan(found) and np.isnan(expected)), name


def test_always_sweep_over_a_holder_runs_without_notes_of_faults(capsys):
    """Patches that differ in tilt and in the stiffness of their holder are solved together."""
    over = {
        "contact.tilt.angle": ["10 urad", "100 urad"],
        "contact.holder.rotational_stiffness": ["100 N m/rad", "3000 N m/rad"],
    }
    found = pf.sweep(pf.new("patch"), over)
    assert "internal fault" not in capsys.readouterr().err
    assert (found["outcome"] == found["outcome"].values.flat[0]).all()
