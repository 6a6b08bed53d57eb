"""What a sweep would take, from the plans of a few of its cases; nothing is run."""

from __future__ import annotations

import numpy as np

from ...core import PatchfemError
from ...runs.many.many import batch_compile_seconds, batch_of
from ...runs.plan import plan
from ...scene.axes import Axis
from .asked import Asked
from .cases import Cases

LOOKED = 9  # cases that are planned, spread over the sweep
ONCE = 0.75  # seconds of a plan that a sweep spends once: its start, its files and its page
TOGETHER = 1.2e-3  # seconds of a case of a batch from its values to its columns (0.8 to 1.5 ms of 2000 lumped cases)
FEW = 1000  # cases of a sweep that has the summary of each unless it is asked otherwise
TABLED = 200_000  # cases of a sweep that has its tables unless they are asked for
# bytes of a case with its summary, and without: tables, page and columns of 10 000 cases, columns of a million
DISK, COLUMNS, BARE = 6000, 1600, 400


def estimate(asked: Asked, cases: Cases) -> dict:
    """The plan of a sweep: that of its first valid case, named by `case` {key: value as written}, with seconds of all
    cases on one core, the bytes that a case needs at most, how many cases there are, how many values of each key, and
    bytes on disk.

    PatchfemError where none of the planned cases can run.
    """
    plans, numbers, wrong = [], [], None
    for number in cases.looked(LOOKED):
        try:
            plans.append(plan(asked.model(cases.sets(number))))
            numbers.append(number)
        except PatchfemError as error:
            wrong = wrong or error
    if not plans:
        raise wrong
    alone = [max(one.seconds - ONCE, TOGETHER) for one in plans]
    batches = [batch_of(one.model, len(cases)) for one in plans]
    each = sum(one if batch is None else max(TOGETHER, batch.share * one) for one, batch in zip(alone, batches))
    each /= len(plans)
    once = ONCE + max(one * (batch is not None) for one, batch in zip(alone, batches))  # the first as a single run
    first = batches[0]
    compiles = plans[0].compile_seconds if first is None else batch_compile_seconds(first, plans[0].model)
    return plans[0].as_json() | {
        "compile_seconds": compiles, "seconds": round(once + each * len(cases), 2), "seconds_per_case": round(each, 4),
        "bytes": max(one.bytes for one in plans), "cases": len(cases),
        "case": {axis.key: text for axis, text in zip(cases.axes, cases.texts(numbers[0]))},
        "disk_bytes": (DISK if len(cases) <= FEW else COLUMNS if len(cases) <= TABLED else BARE) * len(cases),
        "values": {axis.key: _values(axis) for axis in cases.axes}}


def _values(axis: Axis) -> int:
    """How many values a key has; those of numbers are counted without their texts."""
    return np.unique(axis.values).size if axis.unit else len(set(axis.texts))
