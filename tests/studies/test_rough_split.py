"""The study of split traces: its own program against closed forms, and one trace by all programs."""

from __future__ import annotations

import numpy as np
import pytest
from study_module import load_study, make_study_fixture

from patchfem.closed_forms import contact as closed_forms

own = make_study_fixture("contact/own_patch.py")


def test_exact_a_laterally_free_column_is_a_bar(own):
    """A bar with Poisson's ratio 0: the compliance under a uniform pressure is height over modulus."""
    matrix = own.compliance(2e-3, 1e-3, 16, 200e9, 0.0)
    areas = np.full(17, 2e-3 / 16)
    areas[[0, -1]] /= 2
    assert matrix @ areas == pytest.approx(np.full(17, 1e-3 / 200e9), rel=1e-9)


def test_the_own_program_finds_a_hertz_contact(own):
    """Two pieces with a crown in the gap; the contact is small beside them."""
    length, height, columns, radius, load = 10e-3, 5e-3, 400, 0.05, 1e5
    x = np.linspace(-length / 2, length / 2, columns + 1)
    areas = np.full(x.size, length / columns)
    areas[[0, -1]] /= 2
    matrix = own.compliance(length, height, columns, 200e9, 0.3)
    found = own.press(matrix, x**2 / (2 * radius), areas, load)
    modulus = closed_forms.combined_modulus(200e9, 0.3)
    half = closed_forms.hertz_half_width(load, radius, modulus)
    assert found.pressure.max() == pytest.approx(2 * load / (np.pi * half), rel=0.01)
    assert found.fraction * length / 2 == pytest.approx(half, abs=length / columns)


@pytest.mark.slow
def test_all_programs_agree_on_a_trace(tmp_path):
    """A trace that is not among the twenty; the split agrees within its errors."""
    rough = load_study("contact/rough_split.py")
    matrices = []
    for every in (2, 4):
        columns = rough.STEPS // every
        matrix = rough.own_patch.compliance(
            rough.LENGTH, rough.HEIGHT, columns, rough.YOUNG, rough.POISSON
        )
        matrices.append((matrix, every))
    answers = rough.compare(1003, tmp_path, matrices)
    assert rough.is_within(answers["unsplit"], answers["own"]).all()
    assert rough.is_within(answers["split"], answers["unsplit"]).all()
