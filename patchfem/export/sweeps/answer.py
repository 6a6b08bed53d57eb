"""sweep.json: what a sweep comes to, in one sentence and in numbers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ...disk.whole import write_text
from ...runs.many.answers import FAILED
from ..pages.allowed import as_json
from ..pages.lead import lead_of


def answer_of(table: dict) -> dict:
    """What a sweep comes to; table: as `pages.sweep.page` takes it.

    `answer`: one sentence; `cases`: `count`, `failed`, `unfinished` (without an answer yet) and `over_tolerance`
    {measure: {`count`, `worst`: largest error/|value|}}; `ranking` {measure: [{`key`, `first`, `total`, `low`,
    `high`}]}, shares of the keys in the variance of a measure, {} where the cases do not tell them; `limits`
    [{`measure`, `key`, `value`, `unit`, `change`, `low`, `high`}]: how far a key may go, between which cases, SI.
    """
    lead, outcome = lead_of(table), np.asarray(table["outcome"], str)
    return {"answer": lead.answer(), "cases": {
        "count": outcome.size, "failed": int(np.sum(outcome == FAILED)), "unfinished": int(np.sum(outcome == "")),
        "over_tolerance": lead.missed},
        "ranking": {name: [one._asdict() for one in shares] for name, shares in lead.ranks.items()},
        "limits": as_json(lead.limits)}


def write_answer(table: dict, path: Path) -> str:
    """Write sweep.json to `path`; its sentence."""
    found = answer_of(table)
    write_text(path, json.dumps(found, allow_nan=False, ensure_ascii=False, indent=1) + "\n")
    return found["answer"]
