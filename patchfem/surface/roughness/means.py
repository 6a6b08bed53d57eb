"""Means of the parameters of several traces, or of several scans, of similar surfaces."""

from collections.abc import Mapping
from typing import NamedTuple

from ..quantity import Quantity, average_quantities
from .report import RoughnessReport

# Ratio of the largest to the smallest size above which the files get a caution.
MAX_SIZE_RATIO = 1.001
KINDS = {"profile": "traces", "areal": "scans"}


class Means(NamedTuple):
    """Mean roughness parameters over several reports of one kind.

    values: `Mean` by name; caution: a sentence on their limits, "" for none.
    """

    kind: str
    count: int
    values: Mapping
    caution: str


def average_reports(reports: list[RoughnessReport]) -> list[Means]:
    """Average the roughness parameters over all traces, and over all scans.

    Each kind needs two reports or more. The 95 % intervals come from the scatter by Student's t; the
    interval of a single file describes the same scatter and is not added.
    """
    out = []
    for kind in KINDS:
        same_kind = [report for report in reports if report.kind == kind]
        if len(same_kind) < 2:
            continue
        tables = [
            {value.name: value for value in report.values if value.value is not None}
            for report in same_kind
        ]
        values = {}
        for name, first in tables[0].items():
            if all(name in table for table in tables):
                values[name] = average_quantities(
                    [_drop_interval(table[name]) for table in tables], first.text
                )
        out.append(Means(kind, len(same_kind), values, _describe_caution(same_kind)))
    return out


def _drop_interval(value: Quantity) -> Quantity:
    """Drop the interval of a parameter; only skewness and the step of a window may be negative."""
    is_signed = value.name.endswith("sk") or value.name == "ASH"
    return value._replace(low=None if is_signed else 0.0, high=None)


def _describe_caution(reports: list[RoughnessReport]) -> str:
    """Return the reason why the means of these reports are of limited use, or "" if there is none."""
    if len({report.source for report in reports}) < len(reports):
        return "one file is given twice, so this file counts twice in the means"
    lengths = [report.sampling.length for report in reports]
    steps = [report.sampling.step for report in reports]
    sizes = {"lengths": lengths, "spacings": steps}
    parts = [name for name, each in sizes.items() if max(each) > MAX_SIZE_RATIO * min(each)]
    if not parts:
        return ""
    return (
        f"the {KINDS[reports[0].kind]} differ in their {' and '.join(parts)}, so the means of "
        "extremes and slopes mix quantities that are defined differently"
    )
