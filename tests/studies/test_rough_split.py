"""The study of split traces: its independent solver and one trace by all programs."""

from __future__ import annotations

import numpy as np
import pytest
from study_module import load_study, make_study_fixture

from patchfem.closed_forms import contact as closed_forms

own = make_study_fixture("contact/own_patch.py")


def test_exact_compliance_without_lateral_contraction_is_that_of_a_bar(own):
    """With Poisson's ratio 0, the compliance under uniform pressure is height / Young's modulus."""
    matrix = own.compliance(2e-3, 1e-3, 16, 200e9, 0.0)
    areas = np.full(17, 2e-3 / 16)
    areas[[0, -1]] /= 2
    assert matrix @ areas == pytest.approx(np.full(17, 1e-3 / 200e9), rel=1e-9)


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


@pytest.mark.slow
def test_all_programs_agree_on_a_trace(tmp_path):
    """On a trace outside the study's twenty, the programs agree within their error estimates."""
    study = load_study("contact/rough_split.py")
    matrices = []
    for stride in (2, 4):
        columns = study.STEPS // stride
        matrix = study.own_patch.compliance(
            study.LENGTH, study.HEIGHT, columns, study.YOUNG, study.POISSON
        )
        matrices.append((matrix, stride))
    answers = study.compare(1003, tmp_path, matrices)
    assert study.is_within(answers["unsplit"], answers["own"]).all()
    assert study.is_within(answers["split"], answers["unsplit"]).all()
