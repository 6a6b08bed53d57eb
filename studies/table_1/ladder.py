"""How much of Table 1 does each rung explain, fitted at 143 Hz, with one frequency left out, and on all rows?

The recipe, which models, free keys with their ends, starts, readings and protocols, stands in `rungs.py` and was fixed
before any of these scores was computed. What was computed is kept in scores.json, and README.md has the whole table.

Run: python studies/table_1/ladder.py [minutes]; with minutes it fits for so long what the recipe has and scores.json
has not.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from fitting import fitted, keep, known
from rungs import variants
from table import tables


def main(minutes: float = 0.0) -> dict:
    """Fit what is not yet known, in the order of the recipe, for so many minutes; print the tables and return all that
    is known: (rung, reading, protocol, placebo) -> record."""
    rows, until = known(), time.monotonic() + 60 * minutes
    for variant in variants():
        if variant in rows or time.monotonic() >= until:
            continue
        rows[variant] = fitted(*variant)
        keep(rows)
        print(f"{' / '.join(part for part in variant if part)}: {rows[variant]['seconds']} s", flush=True)
    print("\n".join(tables(rows)))
    return rows


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 0.0)
