"""sweep.json: the summary of a sweep, in one sentence and in numbers."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from ...disk.atomic_write import write_text
from ...runs.batch.case_results import FAILED_OUTCOME
from ..pages.headline import SweepHeadline
from ..pages.limits import limits_json

NONE = MappingProxyType({})


def sweep_summary(
    lead: SweepHeadline, outcome: Sequence, sign: str = "", identity: Mapping = NONE
) -> dict:
    """Return the summary of a sweep as a dict that can be written as JSON.

    `answer`: one sentence; `sentences`: all that is printed; `cases`: `count`, `failed`,
    `unfinished` (without a result), `outcomes` {outcome: count} and `over_tolerance` {measure:
    {`count`, `worst`: largest error/|value|}}; `ranking` {measure: [{`key`, `first`, `total`,
    `low`, `high`}]}: Sobol indices of the keys, {} if the cases do not determine them; `limits`
    [{`measure`, `key`, `value`, `unit`, `change`, `low`, `high`}]: limits of a key and the cases
    between which they lie, in SI.

    Parameters
    ----------
    lead : SweepHeadline
    outcome : sequence of str
        Outcome of each case.
    sign : str
        Hash of what the tables were written for (`run.hash_tables`).
    identity : mapping
        Scene and keys of the sweep (`run.sweep_identity`).

    Returns
    -------
    dict
    """
    counts = dict(Counter(map(str, outcome)).most_common())
    return {
        "answer": lead.answer(),
        "sentences": lead.sentences(),
        "cases": {
            "count": len(outcome),
            "failed": counts.get(FAILED_OUTCOME, 0),
            "unfinished": counts.get("", 0),
            "outcomes": counts,
            "over_tolerance": lead.missed,
        },
        "ranking": {
            name: [index._asdict() for index in indices] for name, indices in lead.ranks.items()
        },
        "limits": limits_json(lead.limits),
        "of": dict(identity),
        "sign": sign,
    }


def write_answer(answer: dict, path: Path) -> None:
    """Write sweep.json to `path`."""
    write_text(path, json.dumps(answer, allow_nan=False, ensure_ascii=False, indent=1) + "\n")


def read_answer(path: Path) -> dict:
    """Return the contents of sweep.json, or {} if it cannot be read."""
    try:
        answer = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return answer if isinstance(answer, dict) and isinstance(answer.get("cases"), dict) else {}
