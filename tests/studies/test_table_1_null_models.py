"""Power laws without mechanics, with which the rungs of Table 1 are compared."""

import numpy as np
import pytest
from study_module import make_study_fixture

from patchfem.campaigns.rows.cells import compute_rms_scores, read_response_table

models = make_study_fixture("table_1/null_models.py")
fitting = make_study_fixture("table_1/fitting.py")


def test_exact_table_1_null_models_agree_with_closed_forms(models, fitting):
    """Null models of table 1 agree with a mean of logarithms within 1e-12 and with normal equations within 1e-8."""
    cells = read_response_table(fitting.TABLE)
    f, a = cells.conditions[cells.condition].T
    train = ~cells.select_readings("frequency=135 Hz,150 Hz,155 Hz")
    every = np.ones(train.size, bool)
    for kind in (cells.is_acceleration, ~cells.is_acceleration):
        ratio = np.log(cells.measured / a)
        logs, _ = models.fit_null_model(cells, "constant", train)
        assert np.abs(logs - (ratio[kind & train].mean() - ratio))[kind].max() < 1e-12
    table = np.stack([0 * f + 1, np.log(a), np.log(f)], axis=1)[cells.is_acceleration]
    y = np.log(cells.measured)[cells.is_acceleration]
    factor = np.linalg.solve(table.T @ table, table.T @ y)
    logs, numbers = models.fit_null_model(cells, "power_input_frequency", every)
    assert np.abs(logs[cells.is_acceleration] - (table @ factor - y)).max() < 1e-8
    assert numbers["acceleration"] == pytest.approx(
        {"factor": np.exp(factor[0]), "input": factor[1], "frequency": factor[2]}, rel=1e-6
    )


def test_exact_table_1_null_scores_with_frequency_left_out(models, fitting):
    """The scores of null models of table 1 with one frequency left out agree with an independent program:

    0.125 and 0.090.
    """
    cells = read_response_table(fitting.TABLE)
    every = np.ones(cells.row.size, bool)
    found = {}
    for name in models.NULL_MODELS:
        left = np.full(cells.row.size, np.nan)
        for part in cells.group_by_column("frequency", every).values():
            left[part] = models.fit_null_model(cells, name, ~part)[0][part]
        found[name] = compute_rms_scores(cells, left, every)
    assert found["constant"] == pytest.approx(
        {"acceleration": 0.125, "displacement": 0.580, "all": 0.298}, abs=6e-4
    )
    assert found["power_input_frequency"]["acceleration"] == pytest.approx(0.090, abs=6e-4)


def test_exact_null_model_keeps_undetermined_powers(models, tmp_path):
    """A null model keeps a power of 0 for a single frequency, and of 1 for a single input."""
    path = tmp_path / "rows.csv"
    header = "frequency [Hz],input [g],acceleration [g],displacement [mil],flag"
    path.write_text("\n".join([header, "143,4,5,,", "143,5,7,,", "150,4,9,,"]), "utf-8")
    cells = read_response_table(path)
    one = models.fit_null_model(cells, "power_input_frequency", np.array([True, True, False]))[1][
        "acceleration"
    ]
    assert one["frequency"] == pytest.approx(0.0, abs=1e-12)
    assert one["input"] == pytest.approx(np.log(7 / 5) / np.log(5 / 4), rel=1e-12)
    two = models.fit_null_model(cells, "power_input_frequency", np.array([True, False, True]))[1][
        "acceleration"
    ]
    assert two["input"] == pytest.approx(1.0, abs=1e-12)
    assert two["frequency"] == pytest.approx(np.log(9 / 5) / np.log(150 / 143), rel=1e-12)
