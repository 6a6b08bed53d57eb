"""Estimate of the time and disk space of a sweep from the plans of a few of its cases.

Nothing is run.
"""

from __future__ import annotations

import numpy as np

from ...core import PatchfemError
from ...runs.batch.batches import batch_compile_seconds, choose_batch
from ...runs.plan import plan
from ...scene.axes import Axis
from .case_models import SweepScene
from .cases import Cases

MAX_PLANNED_CASES = (
    9  # number of cases, spread over the sweep, whose plans estimate the cost of all
)
SWEEP_SECONDS = (
    0.75  # seconds that a sweep needs in total to start and to write its files and its page
)
CASE_SECONDS = (
    8e-3  # seconds of a case that is not computed in a batch, in addition to those of its plan
)
RANKING_SECONDS = 0.8  # seconds to rank the keys by their influence, from random cases
# If the planned cases form at most this number of groups, all cases are assumed to form no more groups.
MAX_GROUPS = 3
# Seconds to compute the columns of a case in a batch from its values (0.8 to 1.5 ms of 2000 lumped cases).
BATCHED_CASE_SECONDS = 1.2e-3
MAX_CASES_WITH_SUMMARY = (
    1000  # maximum number of cases of which a sweep writes a summary each by default
)
MAX_CASES_WITH_TABLES = (
    200_000  # maximum number of cases for which a sweep writes tables by default
)
# Bytes per case: with a summary; with tables, page and columns (10 000 cases); with only the columns
# (a million cases).
DISK, COLUMNS, BARE = 6000, 1600, 400


def estimate_sweep(asked: SweepScene, cases: Cases) -> dict:
    """Return the plan of a sweep as a dict that can be written as JSON.

    It is the plan of the first valid case, which `case` {key: value as written} names, with seconds
    for all cases on one core, the largest number of bytes of memory that a case needs, the number
    of cases, the number of values of each key, and bytes on disk.

    Raises
    ------
    PatchfemError
        If none of the planned cases can run.
    """
    plans = []
    numbers = []
    wrong = None
    for number in cases.representative_cases(MAX_PLANNED_CASES):
        try:
            plans.append(plan(asked.model(cases.sets(number))))
            numbers.append(number)
        except PatchfemError as error:
            wrong = wrong or error
    if not plans:
        raise wrong
    batches = [choose_batch(one.model, len(cases)) for one in plans]
    once, alone = _split_shared_seconds(plans)
    once += RANKING_SECONDS * (cases.drawn and len(cases.axes) > 1)
    keys = [None if batch is None else batch.group(one.model) for one, batch in zip(plans, batches)]
    each = [
        one if key is None else max(BATCHED_CASE_SECONDS, batch.share * one)
        for one, key, batch in zip(alone, keys, batches)
    ]
    groups = {
        (batch.name, key if batch.share else ())
        for batch, key in zip(batches, keys)
        if key is not None
    }
    if groups:  # The first case of each group takes as long as a single run.
        begun = np.mean(
            [one - other for one, other, key in zip(alone, each, keys) if key is not None]
        )
        once += (
            len(groups)
            * (len(cases) / len(plans) if len(groups) > MAX_GROUPS else 1.0)
            * max(float(begun), 0.0)
        )
    seconds = once + sum(each) / len(plans) * len(cases)
    first = batches[0]
    compiles = (
        plans[0].compile_seconds if first is None else batch_compile_seconds(first, plans[0].model)
    )
    return plans[0].as_json() | {
        "compile_seconds": compiles,
        "seconds": round(SWEEP_SECONDS + seconds, 2),
        "seconds_per_case": round(seconds / len(cases), 4),
        "bytes": max(one.bytes for one in plans),
        "cases": len(cases),
        "case": {axis.key: text for axis, text in zip(cases.axes, cases.texts(numbers[0]))},
        "disk_bytes": (
            DISK
            if len(cases) <= MAX_CASES_WITH_SUMMARY
            else COLUMNS
            if len(cases) <= MAX_CASES_WITH_TABLES
            else BARE
        )
        * len(cases),
        "values": {axis.key: _count_values(axis) for axis in cases.axes},
    }


def _split_shared_seconds(plans: list) -> tuple[float, list]:
    """Return the seconds that all cases share, and the seconds of each planned case by itself.

    A case of a sweep needs no start and no fields. Pieces that are the same in all cases are
    condensed once.
    """
    costs = [each.cost for each in plans]
    shared = 0.0
    left_out = {"start", "code", "fields"}
    patches = [each.model.patch for each in plans]
    if None not in patches:
        from ...runs.patch.meshes import (
            geometry_key,  # imported here, because sweeps of a point need no mesh
        )

        if len({geometry_key(patch) for patch in patches}) == 1:
            left_out.add("condensing")
            shared = max(cost.times["condensing"] for cost in costs)
    own = [
        sum(seconds for name, seconds in cost.times.items() if name not in left_out)
        for cost in costs
    ]
    return shared, [seconds + CASE_SECONDS for seconds in own]


def _count_values(axis: Axis) -> int:
    """Return the number of distinct values of a key; numbers are compared in SI, not as strings."""
    return np.unique(axis.values).size if axis.unit else len(set(axis.texts))
