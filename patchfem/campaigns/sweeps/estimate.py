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

# Number of cases, spread over the sweep, whose plans estimate the cost of all.
MAX_PLANNED_CASES = 9
SWEEP_SECONDS = 0.75  # CPU time [s] of a sweep to start and to write its files and its page
CASE_SECONDS = 8e-3  # CPU time [s] of a case outside a batch, in addition to that of its plan
RANKING_SECONDS = 0.8  # CPU time [s] to rank the keys by their influence, from random cases.
# Largest number of groups of the planned cases that is assumed to hold for all cases.
MAX_GROUPS = 3
# CPU time [s] to compute the columns of a case in a batch from its values (0.8 to 1.5 ms, measured on 2000
# lumped cases).
BATCHED_CASE_SECONDS = 1.2e-3
# Largest number of cases for which a sweep writes individual summaries by default.
MAX_CASES_WITH_SUMMARY = 1000
# Largest number of cases for which a sweep writes tables by default.
MAX_CASES_WITH_TABLES = 200_000
# Bytes on disk per case with a summary; with tables, page and columns (10 000 cases); with columns
# alone (a million cases).
SUMMARY_BYTES = 6000
TABLE_BYTES = 1600
COLUMN_BYTES = 400


def estimate_sweep(sweep_scene: SweepScene, cases: Cases) -> dict:
    """Estimate time, memory and disk space of a sweep, as a dict that can be written as JSON.

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
    first_error = None
    for number in cases.representative_cases(MAX_PLANNED_CASES):
        try:
            plans.append(plan(sweep_scene.model(cases.sets(number))))
            numbers.append(number)
        except PatchfemError as error:
            first_error = first_error or error
    if not plans:
        raise first_error
    batches = [choose_batch(case_plan.model, len(cases)) for case_plan in plans]
    seconds = _predict_seconds(plans, batches, len(cases))
    if cases.drawn and len(cases.axes) > 1:
        seconds += RANKING_SECONDS
    compile_seconds = plans[0].compile_seconds
    if batches[0] is not None:
        compile_seconds = batch_compile_seconds(batches[0], plans[0].model)
    return plans[0].as_json() | {
        "compile_seconds": compile_seconds,
        "seconds": round(SWEEP_SECONDS + seconds, 2),
        "seconds_per_case": round(seconds / len(cases), 4),
        "bytes": max(case_plan.bytes for case_plan in plans),
        "cases": len(cases),
        "case": {axis.key: text for axis, text in zip(cases.axes, cases.texts(numbers[0]))},
        "disk_bytes": _bytes_per_case(len(cases)) * len(cases),
        "values": {axis.key: _count_values(axis) for axis in cases.axes},
    }


def _predict_seconds(plans: list, batches: list, n_cases: int) -> float:
    """Predict the CPU time [s] of all cases on one core.

    Parameters
    ----------
    plans : list of Plan
        Plans of some cases.
    batches : list of Batch or None
        The batch of each of these cases; None for a case that is computed alone.
    n_cases : int
        Number of all cases.
    """
    shared, single_seconds = _split_shared_seconds(plans)
    case_seconds = []
    batch_starts = []
    groups = set()
    for case_plan, batch, seconds in zip(plans, batches, single_seconds):
        key = None if batch is None else batch.group(case_plan.model)
        if key is None:
            case_seconds.append(seconds)
            continue
        in_batch = max(BATCHED_CASE_SECONDS, batch.share * seconds)
        case_seconds.append(in_batch)
        batch_starts.append(seconds - in_batch)
        groups.add((batch.name, key if batch.share else ()))
    if groups:
        # The first case of each group takes as long as a single run.
        n_groups = float(len(groups))
        if len(groups) > MAX_GROUPS:
            n_groups *= n_cases / len(plans)
        shared += n_groups * max(float(np.mean(batch_starts)), 0.0)
    return shared + sum(case_seconds) / len(plans) * n_cases


def _bytes_per_case(n_cases: int) -> int:
    """Return the bytes on disk per case in a sweep of `n_cases` cases."""
    if n_cases <= MAX_CASES_WITH_SUMMARY:
        return SUMMARY_BYTES
    return TABLE_BYTES if n_cases <= MAX_CASES_WITH_TABLES else COLUMN_BYTES


def _split_shared_seconds(plans: list) -> tuple[float, list]:
    """Split the CPU time [s] of planned cases into a shared and an individual part.

    A case of a sweep needs no start and no fields. Pieces that are the same in all cases are
    condensed once.
    """
    shared = 0.0
    left_out = {"start", "code", "fields"}
    patches = [case_plan.model.patch for case_plan in plans]
    if None not in patches:
        # This module is imported here, because sweeps of a point need no mesh.
        from ...runs.patch.sweep_meshes import geometry_key

        if len({geometry_key(patch) for patch in patches}) == 1:
            left_out.add("condensing")
            shared = max(case_plan.cost.times["condensing"] for case_plan in plans)
    single_seconds = []
    for case_plan in plans:
        times = case_plan.cost.times
        own_times = [seconds for name, seconds in times.items() if name not in left_out]
        single_seconds.append(sum(own_times) + CASE_SECONDS)
    return shared, single_seconds


def _count_values(axis: Axis) -> int:
    """Return the number of distinct values of a key, compared in SI units."""
    return np.unique(axis.values).size if axis.unit else len(set(axis.texts))
