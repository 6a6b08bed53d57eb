"""How much of Table 1 does each rung explain, fitted at 143 Hz, with one frequency left out, and on all rows?

The recipe, which models, free keys with their ends, starts, readings and protocols, stands in `rungs.py` and was fixed
before any of these scores was computed. `main` works through it, keeps every variant in scores.json as soon as it is
done, and goes on from there when it is run again.

Run: python studies/table_1/ladder.py [minutes]
"""

import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from fitting import fitted
from rungs import HERE, variants

SCORES = HERE / "scores.json"


def known() -> dict:
    """What was computed: (rung, reading, protocol, placebo) -> record."""
    rows = json.loads(SCORES.read_text("utf-8")) if SCORES.exists() else []
    return {(row["rung"], row["reading"], row["protocol"], row["placebo"]): row for row in rows}


def keep(rows: dict) -> None:
    """Write the records, one a line."""
    lines = ",\n".join(json.dumps(row) for row in rows.values())
    partial = SCORES.with_suffix(".partial")
    partial.write_text(f"[\n{lines}\n]\n", "utf-8")
    partial.replace(SCORES)


def main(minutes: float = float("inf")) -> dict:
    """Fit what is not yet known, in the order of the recipe, for so many minutes; returns all that is known."""
    rows, until = known(), time.monotonic() + 60 * minutes
    for variant in variants():
        if variant in rows or time.monotonic() > until:
            continue
        rows[variant] = fitted(*variant)
        keep(rows)
        one = rows[variant]
        print(f"{' / '.join(part for part in variant if part):<70} {one['seconds']:>7.1f} s  {one['motions']} motions",
              flush=True)
    return rows


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else float("inf"))
