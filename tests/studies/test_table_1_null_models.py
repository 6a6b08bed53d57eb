"""Power laws without mechanics, with which the rungs of Table 1 are compared."""

from types import SimpleNamespace

import numpy as np
import pytest
from study_module import make_study_fixture

from patchfem.campaigns.rows.cells import read_response_table

models = make_study_fixture("table_1/null_models.py")
fitting = make_study_fixture("table_1/fitting.py")


def test_exact_table_1_null_models_agree_with_closed_forms(models, fitting):
    """Null models of table 1 agree with a mean of logarithms within 1e-12 and with normal equations within 1e-8."""
    cells = read_response_table(fitting.TABLE)
    f, a = cells.conditions[cells.condition].T
    train = fitting.training(cells, "143")
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


def test_exact_search_of_the_ladder_finds_the_constant_null_model(models, fitting):
    """The search from two random starts ends at the optimum in closed form and states its rms."""
    cells = read_response_table(fitting.TABLE)
    train = ~cells.unstable

    def computed(values, conditions):
        """Return readings proportional to the input; `values` are the logarithms of both factors."""
        return np.exp(values)[:, None] * cells.conditions[:, 1]

    ranges = [SimpleNamespace(low=low, high=high) for low, high in ((-3, 3), (-17, -12))]
    computed.models = SimpleNamespace(ranges=ranges)
    computed.reset_motions = lambda: None
    values, ends, valleys = fitting.search_starts(cells, computed, train, 2, 2)
    logs, numbers = models.fit_null_model(cells, "constant", train)
    factors = [numbers[kind]["factor"] for kind in ("acceleration", "displacement")]
    assert np.exp(values) == pytest.approx(factors, rel=1e-6)
    assert ends == pytest.approx([fitting.rms(logs[train])] * 2, rel=1e-6)
    assert valleys == {"starts": 2, "best": 2, "tied": []}
