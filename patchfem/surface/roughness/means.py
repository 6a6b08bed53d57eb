"""Means of the parameters of several traces, or of several scans, that were measured on alike surfaces."""

from collections.abc import Mapping
from typing import NamedTuple

from ..quantity import Quantity, mean_of
from .report import RoughnessReport

ALIKE = 1e-3  # share to which lengths and spacings agree
KINDS = {"profile": "traces", "areal": "scans"}


class Means(NamedTuple):
    """kind: of the reports; count: how many; values: name -> `Mean`; doubt: what the means do not know, a sentence, ""
    for nothing."""

    kind: str
    count: int
    values: Mapping
    doubt: str


def means_of(reports: list[RoughnessReport]) -> list[Means]:
    """The means of the parameters that all traces have, and those that all scans have, where there are two of them.

    Their 95 % interval is Student's t of the scatter; the interval of each file tells of the same scatter. A direction
    (Std), which turns round at 180 degrees, has no mean.
    """
    out = []
    for kind in KINDS:
        of = [one for one in reports if one.kind == kind]
        if len(of) < 2:
            continue
        each = [{value.name: value for value in one.values if value.value is not None} for one in of]
        names = [name for name, one in each[0].items() if one.unit != "rad" and all(name in other for other in each)]
        out.append(Means(kind, len(of), {name: mean_of([_bare(one[name]) for one in each], each[0][name].text)
                                         for name in names}, _doubt(of)))
    return out


def _bare(one: Quantity) -> Quantity:
    """A parameter without its own interval; only skewness and the step of a window may be negative."""
    return one._replace(low=None if one.name.endswith("sk") or one.name == "ASH" else 0.0, high=None)


def _doubt(reports: list) -> str:
    if len({one.source for one in reports}) < len(reports):
        return "one file is given twice, so this file counts twice in the means"
    parts = [name for name, sizes in (("lengths", [one.length for one in reports]),
                                      ("spacings", [one.step for one in reports]))
             if max(sizes) > (1 + ALIKE) * min(sizes)]
    return (f"the {KINDS[reports[0].kind]} differ in their {' and '.join(parts)}, so the means of extremes and slopes "
            "mix quantities that are defined differently") if parts else ""
