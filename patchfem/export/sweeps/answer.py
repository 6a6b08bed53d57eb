"""sweep.json: what a sweep comes to, in one sentence and in numbers."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from ...disk.atomic_write import write_text
from ...runs.batch.case_results import FAILED
from ..pages.headline import SweepHeadline
from ..pages.limits import as_json

NONE = MappingProxyType({})


def answer_of(lead: SweepHeadline, outcome: Sequence, sign: str = "", of: Mapping = NONE) -> dict:
    """What a sweep comes to; outcome: of each case; sign, of: what the tables were written for (`run.sign_of`,
    `run.signed_of`).

    `answer`: one sentence; `sentences`: all that is printed; `cases`: `count`, `failed`, `unfinished` (without an
    answer yet), `outcomes` {outcome: count} and `over_tolerance` {measure: {`count`, `worst`: largest error/|value|}};
    `ranking` {measure: [{`key`, `first`, `total`, `low`, `high`}]}, shares of the keys in the variance of a measure, {}
    where the cases do not tell them; `limits` [{`measure`, `key`, `value`, `unit`, `change`, `low`, `high`}]: how far
    a key may go, between which cases, SI.
    """
    counts = dict(Counter(map(str, outcome)).most_common())
    return {
        "answer": lead.answer(),
        "sentences": lead.sentences(),
        "cases": {
            "count": len(outcome),
            "failed": counts.get(FAILED, 0),
            "unfinished": counts.get("", 0),
            "outcomes": counts,
            "over_tolerance": lead.missed,
        },
        "ranking": {name: [one._asdict() for one in shares] for name, shares in lead.ranks.items()},
        "limits": as_json(lead.limits),
        "of": dict(of),
        "sign": sign,
    }


def write_answer(found: dict, path: Path) -> None:
    """Write sweep.json to `path`."""
    write_text(path, json.dumps(found, allow_nan=False, ensure_ascii=False, indent=1) + "\n")


def read_answer(path: Path) -> dict:
    """What sweep.json holds, {} where there is none that can be read."""
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and isinstance(found.get("cases"), dict) else {}
