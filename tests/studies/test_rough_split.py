"""The study of split traces: its independent solver, its table, and one trace by all programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from study_module import assert_contains, make_study_fixture

import patchfem
from patchfem.closed_forms import contact as closed_forms

own = make_study_fixture("contact/own_patch.py")
split = make_study_fixture("contact/rough_split.py")


def test_exact_compliance_without_lateral_contraction_is_that_of_a_bar(own):
    """With Poisson's ratio 0, the compliance under uniform pressure is height / Young's modulus."""
    matrix = own.compliance(2e-3, 1e-3, 16, 200e9, 0.0)
    areas = np.full(17, 2e-3 / 16)
    areas[[0, -1]] /= 2
    assert matrix @ areas == pytest.approx(np.full(17, 1e-3 / 200e9), rel=1e-9)


def test_exact_stiffness_without_lateral_contraction_is_that_of_two_bars(own):
    """With Poisson's ratio 0 and without a gap, the stiffness is Young's modulus * length / (2 height)."""
    length, height, young = 2e-3, 1e-3, 200e9
    matrix = own.compliance(length, height, 16, young, 0.0)
    areas = np.full(17, length / 16)
    areas[[0, -1]] /= 2
    contact = own.press(matrix, np.zeros(17), areas, 1e5)
    assert contact.fraction == pytest.approx(1)
    assert contact.pressure == pytest.approx(np.full(17, 1e5 / length), rel=1e-8)
    assert contact.stiffness == pytest.approx(young * length / (2 * height), rel=1e-8)


def test_always_independent_solver_reports_that_it_does_not_converge(own):
    """A solution that is not converged after the last iteration is an error."""
    x = np.linspace(-1e-3, 1e-3, 17)
    matrix = own.compliance(2e-3, 1e-3, 16, 200e9, 0.3)
    with pytest.raises(ArithmeticError, match="after 2 iterations"):
        own.press(matrix, x**2 / 0.1, np.full(17, 1.25e-4), 1e4, max_iterations=2)


def test_independent_solver_agrees_with_hertz_contact(own):
    """Peak pressure and half width of a crowned contact agree with Hertz's closed form.

    The contact is small compared with the two pieces.
    """
    length, height, columns, radius, load = 10e-3, 5e-3, 400, 0.05, 1e5
    x = np.linspace(-length / 2, length / 2, columns + 1)
    areas = np.full(x.size, length / columns)
    areas[[0, -1]] /= 2
    matrix = own.compliance(length, height, columns, 200e9, 0.3)
    contact = own.press(matrix, x**2 / (2 * radius), areas, load)
    modulus = closed_forms.combined_modulus(200e9, 0.3)
    half_width = closed_forms.hertz_half_width(load, radius, modulus)
    assert contact.pressure.max() == pytest.approx(2 * load / (np.pi * half_width), rel=0.01)
    assert contact.fraction * length / 2 == pytest.approx(half_width, abs=length / columns)


def test_exact_split_table_gives_the_stated_counts_and_differences(split):
    """Counts, differences and stated errors in the docstring are those of the table of the study."""
    found = split.read_table()
    assert len(found) == 20
    within = split.count_within(found, ("split", "unsplit"))
    errors = split.relative_errors(found, "split")
    difference = split.relative_differences(found, ("split", "unsplit"))
    stiffness = np.abs(difference[:, 0])
    by_own = np.abs(split.relative_differences(found, ("unsplit", "own")))
    missed = [k for k, a in enumerate(found) if not split.is_within(a["split"], a["unsplit"])[0]]
    assert missed == [13, 19] and np.argsort(stiffness)[-2:].tolist() == [19, 0]
    assert max(found[k]["unsplit"].fraction for k in (0, 19)) < 0.01
    assert [a["unsplit"].fraction < 0.01 for a in found].count(True) == 2
    carried = [answers["split"].fraction for answers in found]
    touching = [answers["unsplit"].fraction for answers in found]
    ratios = [answers["tamaas"][2] for answers in found]
    meshes = {
        model: (
            100 * np.median(np.abs(split.relative_differences(found, (model, "unsplit"))[:, 0])),
            100 * np.median(split.relative_errors(found, model)[:, 0]),
        )
        for model in split.mesh_models()
    }
    unsplit = [meshes[f"unsplit {n}"] for n in split.ELEMENTS]
    layered = [meshes[f"split {n}"] for n in split.ELEMENTS]
    middle, largest = 100 * np.median(errors, axis=0), 100 * errors.max(axis=0)
    assert_contains(
        (Path(patchfem.__file__).parent / "scene/MESH.md").read_text("utf-8"),
        f"contains the stiffness in {within[0]} cases",
        f"{middle[0]:.0f} % of the stiffness (median), at most {largest[0]:.0f} %",
        f"{100 * np.median(stiffness):.0f} % (median), but up to {100 * stiffness[0]:.0f} %",
        f"mean pressure is lower by {-100 * np.median(difference[:, 1]):.0f} % (median)",
    )
    assert_contains(
        split.__doc__,
        "stiffness on {} of 20 traces, in the mean peak on {}, in the bearing length on {}".format(
            *within
        ),
        f"split is {middle[0]:.0f} % (median) and at most {largest[0]:.0f} %",
        f"its mean peak {middle[1]:.0f} % and {largest[1]:.0f} %",
        f"stiffness is {100 * np.median(stiffness):.1f} %; it reaches {100 * stiffness[0]:.0f} % (trace 0",
        f"and {100 * stiffness[19]:.0f} % (trace 19",
        f"lower by {-100 * np.median(difference[:, 1]):.0f} % (median), at most by {-100 * difference[:, 1].min():.0f} %",
        f"carries on {100 * min(carried):.0f} to {100 * max(carried):.0f} %",
        f"touch on {100 * min(touching):.1f} to {100 * max(touching):.0f} %",
        f"within {100 * by_own[:, 0].max():.1f} % (median {100 * np.median(by_own[:, 0]):.1f} %)",
        f"the mean peak within {100 * by_own[:, 1].max():.1f} %",
        f"{min(ratios):.2f} to {max(ratios):.1f} times that of the layer",
        "{:.1f}, {:.1f} and {:.1f} % unsplit".format(*(d for d, _ in unsplit)),
        "(stated errors {:.0f}, {:.0f} and {:.1f} %)".format(*(e for _, e in unsplit)),
        "{:.1f}, {:.1f} and {:.1f} % split".format(*(d for d, _ in layered)),
        "(stated {:.1f}, {:.1f} and {:.2f} %".format(*(e for _, e in layered)),
    )


@pytest.mark.slow
def test_all_programs_reproduce_the_table_on_a_trace(split, tmp_path):
    """On a trace of the study, all programs give the values of the table, and agree within their errors."""
    matrices = []
    for stride in (1, 2):
        columns = split.STEPS // stride
        matrix = split.own_patch.compliance(
            split.LENGTH, split.HEIGHT, columns, split.YOUNG, split.POISSON
        )
        matrices.append((matrix, stride))
    seed = 3
    answers = split.compare(seed, tmp_path, matrices)
    table = split.read_table()[seed]
    for model in ("unsplit", "own", "split", *split.mesh_models()):
        assert answers[model].values == pytest.approx(table[model].values, rel=1e-3)
        assert answers[model].errors == pytest.approx(table[model].errors, rel=0.1)
    assert split.is_within(answers["split"], answers["unsplit"]).all()
    errors = answers["split"].errors / answers["split"].values
    assert (errors < [0.04, 0.34, 0.46]).all()
    own_differences = answers["own"].values / answers["unsplit"].values - 1
    assert (np.abs(own_differences) < 0.01).all()
