"""Warnings of a case of a batch: those that its own run would give."""

from typing import NamedTuple

import numpy as np

from ....core import Measure
from ....effects import has
from ....model.model import Model
from ...remedies import loose
from ...rig.remarks import said_of_law
from ..answers import Answers


class _Plan(NamedTuple):
    model: Model


class _Seen(NamedTuple):
    """What `loose` asks of a result."""

    plan: _Plan
    measures: dict
    patch: None
    extra: dict


def said(model: Model, outcome, found: Answers, case: int, wide: bool) -> list:
    """Warnings of a case: of its law and, where `wide` says that some is, of what is known less well than asked."""
    if not wide and not has(model.friction.law, "bonds"):
        return []
    known = {name: Measure(float(values[case]), found.units[name], float(found.errors[name][case]),
                           float(found.floors[name][case])) for name, values in found.values.items()
             if not np.isnan(found.errors[name][case])}
    drift = {name: one for name, one in known.items() if name == "drift_per_cycle"}
    return [*said_of_law(model, outcome, drift, 0.0), *loose(_Seen(_Plan(model), known, None, {}))]
