"""Prediction of the computing time and disk space of a sweep from the plans of a few cases.

No case is run.
"""

from __future__ import annotations

import numpy as np

from ...core import PatchfemError
from ...runs.batch.batches import batch_compile_seconds, choose_batch
from ...runs.plan import plan
from ...scene.axes import Axis
from .case_models import SweepScene
from .cases import Cases

# Number of cases, spread over the sweep, whose plans are extrapolated to all cases.
MAX_PLANNED_CASES = 9
SWEEP_SECONDS = 0.75  # CPU time [s] to start a sweep and to write its files and its report page
CASE_SECONDS = 8e-3  # CPU time [s] of a case outside a batch, in addition to its planned time
RANKING_SECONDS = 0.8  # CPU time [s] of the Sobol indices of a sweep with random cases.
# Largest number of batch groups among the planned cases that is not extrapolated to all cases.
MAX_GROUPS = 3
# CPU time [s] per case to compute the result columns of a batch (0.8 to 1.5 ms, measured on 2000 lumped
# cases).
BATCHED_CASE_SECONDS = 1.2e-3
# Default maximum number of cases for which individual summaries are written.
MAX_CASES_WITH_SUMMARY = 1000
# Default maximum number of cases for which tables are written.
MAX_CASES_WITH_TABLES = 200_000
# Bytes on disk per case: with summaries; with tables, page and result columns (measured on 10 000
# cases); with result columns only (a million cases).
SUMMARY_BYTES = 6000
TABLE_BYTES = 1600
COLUMN_BYTES = 400


def estimate_sweep(sweep_scene: SweepScene, cases: Cases) -> dict:
    """Predict computing time, memory and disk space of a sweep, as a dict that JSON can represent.

    The dict is the plan of the first valid case, whose keys and values are in `case`. In addition it
    contains the CPU seconds of all cases on one core, the largest memory of a case in bytes, the
    number of cases, the number of values of each key, and the bytes on disk.

    Raises
    ------
    PatchfemError
        If none of the planned cases can run.
    """
    plans = []
    numbers = []
    first_error = None
    for number in cases.representative_case_numbers(MAX_PLANNED_CASES):
        try:
            plans.append(plan(sweep_scene.build_model(cases.assignments(number))))
            numbers.append(number)
        except PatchfemError as error:
            first_error = first_error or error
    if not plans:
        raise first_error
    batches = [choose_batch(case_plan.model, len(cases)) for case_plan in plans]
    seconds = _predict_sweep_seconds(plans, batches, len(cases))
    if cases.is_random and len(cases.axes) > 1:
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
        "disk_bytes": _disk_bytes_per_case(len(cases)) * len(cases),
        "values": {axis.key: _count_distinct_values(axis) for axis in cases.axes},
    }


def _predict_sweep_seconds(plans: list, batches: list, n_cases: int) -> float:
    """Predict the CPU time [s] of all cases on one core.

    Parameters
    ----------
    plans : list of Plan
        Plans of some cases.
    batches : list of Batch or None
        Batch of each of these cases; None for a case that is computed individually.
    n_cases : int
        Number of cases of the sweep.
    """
    shared_seconds, single_seconds = _split_shared_seconds(plans)
    case_seconds = []
    batch_starts = []
    groups = set()
    for case_plan, batch, seconds in zip(plans, batches, single_seconds):
        key = None if batch is None else batch.group_key(case_plan.model)
        if key is None:
            case_seconds.append(seconds)
            continue
        batched_seconds = max(BATCHED_CASE_SECONDS, batch.cost_fraction * seconds)
        case_seconds.append(batched_seconds)
        batch_starts.append(seconds - batched_seconds)
        groups.add((batch.name, key if batch.cost_fraction else ()))
    if groups:
        # The first case of each group takes as long as a single run.
        n_groups = float(len(groups))
        if len(groups) > MAX_GROUPS:
            n_groups *= n_cases / len(plans)
        shared_seconds += n_groups * max(float(np.mean(batch_starts)), 0.0)
    return shared_seconds + sum(case_seconds) / len(plans) * n_cases


def _disk_bytes_per_case(n_cases: int) -> int:
    """Return the bytes on disk per case of a sweep with `n_cases` cases."""
    if n_cases <= MAX_CASES_WITH_SUMMARY:
        return SUMMARY_BYTES
    return TABLE_BYTES if n_cases <= MAX_CASES_WITH_TABLES else COLUMN_BYTES


def _split_shared_seconds(plans: list) -> tuple[float, list]:
    """Split the CPU time [s] of planned cases into a common part and a part for each case.

    The time to start the program and to compute fields does not apply to a case of a sweep. Pieces
    that are equal in all cases are condensed only once, and equal contacts are solved only once.
    """
    shared_seconds = 0.0
    excluded_stages = {"start", "code", "fields"}
    patches = [case_plan.model.patch for case_plan in plans]
    if None not in patches:
        # The import is local because sweeps of a point contact need no mesh.
        from ...runs.patch.store import content_key
        from ...runs.patch.sweep_meshes import geometry_key

        if len({geometry_key(patch) for patch in patches}) == 1:
            excluded_stages.add("condensing")
            shared_seconds = max(case_plan.cost.times["condensing"] for case_plan in plans)
        if len({content_key(patch) for patch in patches}) == 1:
            excluded_stages.add("points")
            shared_seconds += max(case_plan.cost.times.get("points", 0.0) for case_plan in plans)
    single_seconds = []
    for case_plan in plans:
        times = case_plan.cost.times
        own_times = [seconds for name, seconds in times.items() if name not in excluded_stages]
        single_seconds.append(sum(own_times) + CASE_SECONDS)
    return shared_seconds, single_seconds


def _count_distinct_values(axis: Axis) -> int:
    """Return the number of distinct values of a key, compared in SI units."""
    return np.unique(axis.values).size if axis.unit else len(set(axis.texts))
