"""Does a march jump where the curve of steady motions folds?

Yes, and the slower the nearer. The axial mode of the rig at 6 g, its joint elastic-plastic (limit 4 g), on a flexure
that stiffens by 2e10 N/m3: the upper branch ends at 147.678 Hz, the lower at 146.451 Hz, between them are three
motions (balance to 1e-4; to 1e-3 the folds are up to 11 mHz off). Marches whose frequency sweeps up jump down at
148.03, 147.84 and 147.75 Hz for 0.4, 0.1 and 0.025 Hz/s, those that sweep down jump up at 146.03, 146.28 and 146.38 Hz:
always past the fold, late by a delay that goes as the rate to the power 2/3. Drawn back to no rate by it they jump at
147.685 and 146.445 Hz, 7 mHz from the folds. Before the jump the slowest follow their branches within 3e-4 (upper) and
6e-3 (lower).

Run: python studies/steady/fold.py
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from patchfem.export.pictures import BLUE, GREY, ORANGE, STYLE
from patchfem.runs import run as runner
from patchfem.scene import scene

HERE = Path(__file__).parent
LOW, HIGH = 145.0, 149.0  # Hz, ends of the sweeps
RATES = (0.4, 0.1, 0.025)  # Hz/s
STEPS = 400  # per cycle


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """Steady motions along the arc: frequency [Hz], amplitude [m], stable, largest multiplier (k,); folds [Hz]: where
    the upper branch ends, where the lower does."""

    frequency: np.ndarray
    amplitude: np.ndarray
    stable: np.ndarray
    multiplier: np.ndarray
    folds: tuple

    def branch(self, upper: bool) -> tuple:
        """(frequency, amplitude) of the stable upper or lower branch, frequencies rising."""
        turns = np.flatnonzero(np.diff(self.frequency) < 0)
        cut = slice(0, turns[0] + 1) if upper else slice(turns[-1] + 1, None)
        return self.frequency[cut], self.amplitude[cut]


@dataclass(frozen=True, eq=False, slots=True)
class Sweep:
    """A marched sweep: rate [Hz/s], up or down, frequency [Hz] and amplitude [m] at every turn of the slide, where it
    jumps [Hz], and its largest distance from the branch it follows over the amplitude, before it has come within 0.3 Hz
    of the jump."""

    rate: float
    up: bool
    frequency: np.ndarray
    amplitude: np.ndarray
    jump: float
    miss: float


def curve(low: float = 138.0, high: float = 152.0, tolerance: float = 1e-4) -> Curve:
    """The scene by its own method."""
    sets = [f"drive.from={low} Hz", f"drive.to={high} Hz", f"accuracy.tolerance={tolerance}"]
    found = runner.run(runner.plan(scene.load(HERE / "stiffened.toml", sets)), estimate=False).extra["curve"]
    return Curve(found["frequency"], found["amplitude"], found["regime"] == "stable", found["multiplier"],
                 tuple(sorted(found["folds"], reverse=True)))


def sweep(steady: Curve, up: bool, rate: float, steps: int = STEPS, low: float = LOW, high: float = HIGH) -> Sweep:
    """March up or down from rest at the first frequency; the state is carried through."""
    first, last = (low, high) if up else (high, low)
    sets = [f"drive.from={first} Hz", f"drive.to={last} Hz", f"drive.rate={rate} Hz/s",
            f"drive.duration={(high - low) / rate} s", "accuracy.method=march", f"accuracy.steps_per_cycle={steps}"]
    seen = runner.run(runner.plan(scene.load(HERE / "stiffened.toml", sets)), estimate=False).response
    turn = np.abs(seen.output) > 0
    turn[1:-1] &= (np.abs(seen.output[1:-1]) >= np.abs(seen.output[:-2])) & \
        (np.abs(seen.output[1:-1]) >= np.abs(seen.output[2:]))
    frequency = first + (last - first) * seen.time[turn] / seen.time[-1]
    amplitude = np.abs(seen.output[turn])
    f, a = steady.branch(True)
    upper, lower = np.interp(steady.folds, f, a)[0], steady.branch(False)
    middle = (upper + lower[1][0]) / 2
    past, started = amplitude < middle if up else amplitude > middle, np.abs(frequency - first) > 1.0
    past &= started
    jump = float(frequency[np.argmax(past)]) if past.any() else np.nan
    f, a = steady.branch(up)
    until = jump if np.isfinite(jump) else last
    before = frequency < until if up else frequency > until
    follows = before & (np.abs(frequency - first) > 0.5) & (np.abs(frequency - until) > 0.3)
    truth = np.interp(frequency[follows], f, a)
    return Sweep(rate, up, frequency, amplitude, jump,
                 float(np.abs(amplitude[follows] / truth - 1).max(initial=0.0)))


def at_rest(sweeps: list) -> float:
    """Where the two slowest sweeps one way would jump at no rate at all [Hz]: the delay past a fold goes as the rate to
    the power 2/3 (Haberman 1979)."""
    fast, slow = sorted(sweeps, key=lambda s: -s.rate)[-2:]
    return slow.jump - (fast.jump - slow.jump) / ((fast.rate / slow.rate)**(2 / 3) - 1)


def picture(steady: Curve, sweeps: list, path: Path = HERE / "fold.svg") -> Path:
    """The curve of steady motions and the slowest sweeps over it; where they jump over their rate."""
    slow = min(s.rate for s in sweeps)
    with rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.8))
        FigureCanvasSVG(figure)
        left, right = figure.subplots(1, 2, width_ratios=(2, 1))
        for s in sweeps:
            colour, name = (ORANGE, "up") if s.up else (GREY, "down")
            if s.rate == slow:
                left.plot(s.frequency[::5], 1e3 * s.amplitude[::5], ".", color=colour, ms=1.5, rasterized=True)
                left.plot([], [], ".", color=colour, label=f"marched {name}, {s.rate:g} Hz/s")
        for part, style in ((steady.stable, "-"), (~steady.stable, "--")):
            near = part | np.roll(part, 1) | np.roll(part, -1) if style == "--" else part
            left.plot(np.where(near, steady.frequency, np.nan), 1e3 * np.where(near, steady.amplitude, np.nan), style,
                      color=BLUE, lw=1.2, label="steady" if style == "-" else "steady, unstable")
        left.set(xlim=(LOW, HIGH), xlabel="frequency [Hz]", ylabel="amplitude [mm]")
        left.legend(fontsize=8)
        for up, colour, fold in ((True, ORANGE, steady.folds[0]), (False, GREY, steady.folds[1])):
            mine = [s for s in sweeps if s.up == up]
            right.plot([s.rate**(2 / 3) for s in mine], [s.jump for s in mine], "o-", color=colour, ms=4)
            right.plot([0], [fold], "x", color=BLUE)
        right.set(xlabel="rate$^{2/3}$ [(Hz/s)$^{2/3}$]", ylabel="jump [Hz] (x: folds)")
        figure.savefig(path, dpi=200, metadata={"Date": None})
    return path


def main(rates=RATES, path: Path | None = HERE / "fold.svg", **how) -> tuple:
    """(Curve, [Sweep]), printed and drawn."""
    steady = curve()
    print(f"folds at {steady.folds[0]:.4f} Hz (upper branch ends) and {steady.folds[1]:.4f} Hz (lower branch ends); "
          f"{len(steady.frequency)} points, amplitude up to {1e3 * steady.amplitude.max():.3f} mm")
    sweeps = [sweep(steady, up, rate, **how) for rate in rates for up in (True, False)]
    for s in sweeps:
        fold = steady.folds[0 if s.up else 1]
        print(f"  {'up  ' if s.up else 'down'} {s.rate:6g} Hz/s jumps at {s.jump:.3f} Hz, {s.jump - fold:+.3f} Hz from "
              f"the fold; follows its branch within {s.miss:.1e}")
    for up in (True, False):
        mine = [s for s in sweeps if s.up == up]
        if len(mine) > 1:
            print(f"  {'up  ' if up else 'down'} at no rate {at_rest(mine):.4f} Hz")
    if path is not None:
        picture(steady, sweeps, path)
    return steady, sweeps


if __name__ == "__main__":
    main()
