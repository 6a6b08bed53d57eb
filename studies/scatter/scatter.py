"""Would scatter of tilt, load and friction make two runs of Table 1 differ as much as its repeats do?

No, a third of it. The readings that Table 1 has twice scatter by 0.086 (standard deviation of the logarithm of one
acceleration). The model that comes nearest to the table, drawn 2000 times over its 20 conditions with tilts of 0.01 to
0.3 mrad, loads of 25 to 28 lbf and frictions of ten per cent either way, scatters by 0.030: by 0.056 to 0.061 at 5 g,
just above the onset of slip, where a little more friction stops much motion, and by 0.004 to 0.035 elsewhere. Friction
makes 0.7 of that variance, the load 0.2, the tilt 0.01: how much of the patch touches hardly matters while the whole of
it slips. What makes the repeats differ is not among the three.

Run: python studies/scatter/scatter.py [cases] [processes]      (300; the numbers above are of 2000)
"""

import sys
from pathlib import Path

import numpy as np

from patchfem.campaigns.sweeps import executors
from patchfem.campaigns.sweeps.ask import Request, cases_of
from patchfem.campaigns.sweeps.asked import Asked
from patchfem.core import G_N
from patchfem.export.sweeps.run import swept
from patchfem.export.sweeps.tables import contents
from patchfem.inputs.measured import read_table

HERE = Path(__file__).parent
TABLE = HERE.parent / "rig" / "table1.csv"
SCATTERED = {  # between which ends each is drawn
    "contact.tilt.angle": "1e-5 rad..3e-4 rad",   # assumed: 0.1 to 4 um over the patch, by the logarithm
    "contact.load": "25 lbf..28 lbf",             # report: 26 lb in the text, 28 in Fig. 27
    "friction.static": "0.36..0.44"}              # assumed: ten per cent either way
CONDITIONS = {"drive.frequency": ["135 Hz", "143 Hz", "150 Hz", "155 Hz"],
              "drive.acceleration": ["4 g", "5 g", "6 g", "7 g", "8 g"]}
FEWEST = 5  # cases of a condition: a mean and a slope per key leave one to scatter by


def main(cases: int = 2000, processes: int = 1, seed: int = 7) -> dict:
    """Print the spread of every condition beside that of the repeats; returns {"spread", "shares", "repeats", "all"}.

    spread: {(frequency [Hz], input [g]): (cases, standard deviation of the logarithm of the acceleration)}; shares: key
    -> its share of that variance, from a linear fit in every condition, pooled; all: the pooled spread; repeats: that
    of the repeated readings of Table 1. Conditions of fewer than FEWEST cases are left out and counted; ValueError
    where that leaves none.
    """
    found = drawn(cases, processes, seed)
    frequency, level = found.drive_frequency.values, np.round(found.drive_acceleration.values / G_N, 9)
    acceleration = np.log(found.absolute_acceleration_peak.values)
    keys = np.log([found[key.replace(".", "_")].values for key in SCATTERED])
    spread, parts, within = {}, np.zeros(len(SCATTERED)), 0.0
    asked = int(np.prod([len(values) for values in CONDITIONS.values()]))
    for condition in sorted(set(zip(frequency.tolist(), level.tolist()))):
        here = (frequency == condition[0]) & (level == condition[1]) & np.isfinite(acceleration)
        if here.sum() < FEWEST:
            continue
        y, x = acceleration[here] - acceleration[here].mean(), keys[:, here] - keys[:, here].mean(axis=1)[:, None]
        slope = np.linalg.lstsq(x.T, y, rcond=None)[0]
        parts += slope**2 * (x**2).sum(axis=1)  # the keys are drawn independently of each other
        within += (y**2).sum()
        spread[condition] = (int(here.sum()), float(y.std(ddof=1)))
    if not spread:
        raise ValueError(f"{cases} cases leave none of {asked} conditions {FEWEST} or more; ask for {10 * asked} cases "
                         "or more")
    counted = sum(count - 1 for count, _ in spread.values())
    out = {"spread": spread, "shares": dict(zip(SCATTERED, parts / within)), "all": float(np.sqrt(within / counted)),
           "repeats": repeats(), "outcomes": sorted(set(found.outcome.values.tolist()))}
    for (hertz, size), (count, value) in spread.items():
        print(f"{hertz:3.0f} Hz {size:.0f} g   {count:5d} cases   {value:.4f}")
    print(f"{len(spread)} of {asked} conditions {out['all']:.4f}; repeated readings {out['repeats']:.4f}")
    print("shares of the variance: " + ", ".join(f"{key} {share:.2f}" for key, share in out["shares"].items()))
    print("outcomes: " + ", ".join(out["outcomes"]))
    return out


def drawn(cases: int, processes: int, seed: int):
    """The Dataset of `patchfem.sweep`, without the errors of its runs, which nobody asks for here."""
    over = [f"{key}={value if isinstance(value, str) else ','.join(value)}"
            for key, value in (SCATTERED | CONDITIONS).items()]
    scene = HERE / "rig.toml"
    asked = Asked(scene, scene.read_text("utf-8"), ())
    made = cases_of(asked, Request(over, None, cases, False, seed))
    return contents(asked, made, swept(asked, made, executors.of("", processes), estimate=False), ()).to_xarray()


def repeats() -> float:
    """Standard deviation of the logarithm of one reading, from the pairs of Table 1 read twice at one condition."""
    groups = {}
    for row in read_table(TABLE):
        if row.acceleration:
            groups.setdefault((row.frequency, row.input), []).append(np.log(row.acceleration))
    twice = [one for one in groups.values() if len(one) > 1]
    return float(np.sqrt(sum(np.var(one) * len(one) for one in twice) / sum(len(one) - 1 for one in twice)))


if __name__ == "__main__":
    main(*([int(word) for word in sys.argv[1:]] or [300]))
