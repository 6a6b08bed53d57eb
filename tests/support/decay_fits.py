"""In how many fits to a decay the chi square found is within 1 % of the least one beside the true values.

    python tests/support/decay_fits.py --seeds 8000-8029

An even seed makes a block held by a power-law joint (Segalman 2005, 400 sliders), an odd one a block held by one spring
and slider in series, each with a spring and a viscous damper besides. Mass 1 kg, 100 Hz without the joint, a damping
ratio of 1e-3 to 3e-3, a joint of 0.1 to 2 of the spring's stiffness, a slip force of 10 to 80 N, a release from 2 to 10
times the slip force over the stiffness, all drawn evenly in logarithms (exponent: -0.8 to -0.1, evenly). The motion is
that of central differences in steps of 1/400 of a period, kept at every eighth of them for 150 periods, with noise of
2e-4 to 2e-3 of the release. `import --decay` reads it. The fit frees the keys of the joint, each in a range of two
decades that lies at random around the truth, and begins at a random place in it. The least chi square beside the truth
is that of a descent from there by harmonic balance alone. Seeds below 8000 are for making the fit, those from 8000 on
are held out. Printed: a line per seed (both chi squares, their ratio, CPU seconds and evaluations), and the count
within 1 %.
"""

import argparse
import json
import tempfile
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

import patchfem as pf
from patchfem.campaigns.backbone.curves import backbone
from patchfem.campaigns.fits.curve import fit_curve, read_curve
from patchfem.core import PatchfemError
from patchfem.export.lab import imported
from patchfem.identify.least_squares import descend
from patchfem.identify.space import Counted, space
from patchfem.model.model import build
from patchfem.scene.changed import Base
from patchfem.scene.ranges import ranges

LOAD, MASS, OWN, SLIDERS, BETA = 100.0, 1.0, 2 * np.pi * 100.0, 400, 0.5
STEPS, KEPT, PERIODS = 400, 8, 150
UNITS = {"friction.stiffness": " N/m", "friction.bond_length": " m"}
NEAR = 0.01  # of the least chi square beside the truth
SCENE = """\
[normal]
load = "100 N"
[friction]
law = "{law}"
static = {static!r}
{keys}
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = {damping!r}
slide = 1.0
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "1 g"
cycles = 20
"""


class Made(NamedTuple):
    """A decay on disk: the text of its true scene; free: key -> (low, high); start and truth: key -> value."""

    scene: str
    free: dict
    start: dict
    truth: dict


def sliders(law: str, stiffness: float, force: float, chi: float) -> tuple:
    """(stiffness (s,) [N/m], slip force (s,) [N]) of the joint."""
    if law == "elastic-plastic":
        return np.array([stiffness]), np.array([force])
    most = force * (1 + BETA) / (stiffness * (BETA + (chi + 1) / (chi + 2)))
    edges = np.linspace(0, 1, SLIDERS + 1)**(1 / (1 + chi / 2))
    k = np.append(np.diff(edges**(chi + 1)), BETA) / (1 + BETA)
    moment = np.append((chi + 1) / (chi + 2) * np.diff(edges**(chi + 2)), BETA) / (1 + BETA)
    return stiffness * k, stiffness * most * moment


def released(k, limit, damping: float, start: float) -> tuple:
    """(times (n,) [s], motion (n,) [m]) of the block from rest at `start` [m], its joint without force there."""
    step = 2 * np.pi / OWN / STEPS
    out, force = np.empty(STEPS // KEPT * PERIODS), np.zeros(k.size)
    x = start
    before = x + 0.5 * step**2 * OWN**2 * x  # at rest: the motion is even about the beginning
    loss = damping * OWN * step
    for n in range(out.size * KEPT):
        if n % KEPT == 0:
            out[n // KEPT] = x
        after = (2 * x - (1 - loss) * before - step**2 * (OWN**2 * x + force.sum() / MASS)) / (1 + loss)
        force = np.clip(force + k * (after - x), -limit, limit)
        before, x = x, after
    return step * KEPT * np.arange(out.size), out


def made(seed: int, place: Path) -> Made:
    """Write the decay of a seed to `place`; one that dies within three half cycles is drawn again."""
    rng = np.random.default_rng(seed)

    def even(low, high) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    law, record = ("iwan", "elastic-plastic")[seed % 2], place.with_name("record.csv")
    while True:
        damping, stiffness, force = even(1e-3, 3e-3), even(0.1, 2) * MASS * OWN**2, even(10, 80)
        chi = float(rng.uniform(-0.8, -0.1))
        start = even(2, 10) * force / stiffness
        time, x = released(*sliders(law, stiffness, force, chi), damping, start)
        x = x + even(2e-4, 2e-3) * start * rng.standard_normal(x.size)
        record.write_text("time [s],displacement [m]\n" + "".join(f"{t!r},{y!r}\n" for t, y in zip(time.tolist(),
                                                                                                 x.tolist())))
        try:
            imported.imported(record, place, (), False, imported.Estimate(decay=True))
            break
        except PatchfemError:
            continue
    static = force / LOAD
    truth = {"friction.static": static, "friction.stiffness": stiffness, "friction.chi": chi} if law == "iwan" else \
        {"friction.static": static, "friction.bond_length": force / stiffness}
    keys = f'stiffness = "{stiffness!r} N/m"\nchi = {chi!r}\nbeta = {BETA}' if law == "iwan" else \
        f'bond_length = "{force / stiffness!r} m"'
    free, begin = {}, {}
    for key, value in truth.items():
        low = value / even(1.5, 60)
        free[key] = (-0.95, 0.0) if key == "friction.chi" else (low, 100 * low)
        begin[key] = float(rng.uniform(-0.95, 0.0)) if key == "friction.chi" else even(low, 100 * low)
    return Made(SCENE.format(law=law, static=static, keys=keys, damping=damping), free, begin, truth)


def chi_square(fitted) -> float:
    """Sum of squares over their errors of a FittedCurve."""
    measured = fitted.measured
    return float(np.square((fitted.model - measured.value) / measured.error).sum())


def least(one: Made, place: Path, wanted: list) -> float:
    """Chi square at the end of a descent from the true values, each of its curves by harmonic balance."""
    amplitude, measured, error = read_curve(place)
    base = Base(pf.load(one.scene))

    def residual(values) -> np.ndarray:
        model = build(base.changed([key.assigned(float(value)) for key, value in zip(wanted, values)]))
        curve = backbone(model, "", np.unique(amplitude), ("balance",), errors=False).curves["balance"]
        return ((np.array([curve.frequency, curve.damping]) - measured) / error).ravel()

    box = space([key.low for key in wanted], [key.high for key in wanted])
    return descend(Counted(residual, box, quick=True), box.unit(list(one.truth.values())), range(len(wanted)))[1]


def compared(seed: int, known: dict) -> dict:
    """Of a seed: chi squares found and beside the truth (of `known`, where it is there), CPU seconds and evaluations of
    the first, rows."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "decay.csv"
        one = made(seed, place)
        free = [f"{key}={low!r}{UNITS.get(key, '')}..{high!r}{UNITS.get(key, '')}"
                for key, (low, high) in one.free.items()]
        best = known[seed] if seed in known else least(one, place, ranges(free)[0])
        sets = {key: f"{value!r}{UNITS[key]}" if key in UNITS else value for key, value in one.start.items()}
        begin = process_time()
        try:
            fitted = fit_curve(pf.load(one.scene, **sets), place, free)
            chi, count, values = chi_square(fitted), fitted.keys.fit.evaluations, fitted.keys.fit.values.tolist()
        except PatchfemError as reason:
            chi, count, values = np.inf, 0, str(reason)
        return {"seed": seed, "rows": int(read_curve(place)[0].size), "least": best, "found": chi, "ratio": chi / best,
                "seconds": process_time() - begin, "evaluations": count, "values": values,
                "true_values": list(one.truth.values())}


def main() -> None:
    """The seeds of the command line."""
    ask = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    ask.add_argument("--seeds", default="8000-8029", help="first-last")
    ask.add_argument("--known", type=Path, help="what an earlier call printed, from which the least chi squares come")
    given = ask.parse_args()
    lines = given.known.read_text().splitlines() if given.known else []
    known = {one["seed"]: one["least"] for one in map(json.loads, filter(lambda line: line.startswith("{"), lines))}
    first, last = map(int, given.seeds.split("-"))
    ratios = []
    for seed in range(first, last + 1):
        one = compared(seed, known)
        ratios.append(one["ratio"])
        print(json.dumps(one), flush=True)
    print(f"{sum(ratio <= 1 + NEAR for ratio in ratios)} of {len(ratios)} within {100 * NEAR:g} % of the least chi "
          "square beside the truth")


if __name__ == "__main__":
    main()
