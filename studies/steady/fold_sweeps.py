"""The stiffened rig past its folds: the curve of its steady motions, and marches whose frequency sweeps past them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from patchfem.measures import locate_reversals
from patchfem.runs import run as runner
from patchfem.scene import scene

FOLDER = Path(__file__).parent
LOW_END = 145.0  # [Hz] lower end of the sweeps
HIGH_END = 149.0  # [Hz] upper end of the sweeps
# start frequencies of slow sweeps [Hz], just outside the folds, where only one steady state exists
SLOW_STARTS = (
    146.2,
    148.0,
)
SLOW = 0.05  # [Hz/s] a slower sweep is steady 0.3 Hz from its start
STEPS = 400  # steps per cycle


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """Steady motions along the arc.

    Contains frequency [Hz], amplitude [m], stability and largest multiplier (k,), and the
    frequencies of the folds [Hz] at which the upper and the lower branch end.
    """

    frequency: np.ndarray
    amplitude: np.ndarray
    stable: np.ndarray
    multiplier: np.ndarray
    folds: tuple

    def branch(self, upper: bool) -> tuple:
        """Return rising frequencies and amplitudes of the stable upper or lower branch."""
        turns = np.flatnonzero(np.diff(self.frequency) < 0)
        cut = slice(0, turns[0] + 1) if upper else slice(turns[-1] + 1, None)
        return self.frequency[cut], self.amplitude[cut]


@dataclass(frozen=True, eq=False, slots=True)
class Sweep:
    """Time-stepped sweep.

    Contains rate [Hz/s], direction, frequency [Hz] and amplitude [m] at every reversal of the
    slide, frequency of the jump [Hz], and largest relative distance from its branch until 0.3 Hz
    before the jump.
    """

    rate: float
    up: bool
    frequency: np.ndarray
    amplitude: np.ndarray
    jump: float
    miss: float


def curve(low: float = 138.0, high: float = 152.0, tolerance: float = 1e-4) -> Curve:
    """Compute the curve of steady motions by the method of the scene."""
    sets = [f"drive.from={low} Hz", f"drive.to={high} Hz", f"accuracy.tolerance={tolerance}"]
    found = runner.run(
        runner.plan(scene.load(FOLDER / "stiffened.toml", sets)), estimate=False
    ).motion.steady.curve
    return Curve(
        found["frequency"],
        found["amplitude"],
        found["regime"] == "stable",
        found["multiplier"],
        tuple(sorted(found["folds"], reverse=True)),
    )


def sweep(
    steady: Curve,
    up: bool,
    rate: float,
    steps: int = STEPS,
    low: float = LOW_END,
    high: float = HIGH_END,
) -> Sweep:
    """Sweep the frequency up or down by time stepping from rest at the first frequency; the state is carried over."""
    low, high = (
        (max(low, SLOW_STARTS[0]), min(high, SLOW_STARTS[1])) if rate < SLOW else (low, high)
    )
    first, last = (low, high) if up else (high, low)
    sets = [
        f"drive.from={first} Hz",
        f"drive.to={last} Hz",
        f"drive.rate={rate} Hz/s",
        f"drive.duration={(high - low) / rate} s",
        "accuracy.method=march",
        f"accuracy.steps_per_cycle={steps}",
    ]
    seen = runner.run(
        runner.plan(scene.load(FOLDER / "stiffened.toml", sets)), estimate=False
    ).response
    # A long sweep has few samples in a cycle, so that its reversals lie between them.
    time, turns = locate_reversals(seen.time, seen.output, seen.output_rate)
    frequency = first + (last - first) * time / seen.time[-1]
    amplitude = np.abs(turns)
    f, a = steady.branch(True)
    upper = np.interp(steady.folds, f, a)[0]
    lower = steady.branch(False)
    middle = (upper + lower[1][0]) / 2
    past = amplitude < middle if up else amplitude > middle
    started = np.abs(frequency - first) > 1.0
    past &= started
    jump = float(frequency[np.argmax(past)]) if past.any() else np.nan
    f, a = steady.branch(up)
    until = jump if np.isfinite(jump) else last
    before = frequency < until if up else frequency > until
    follows = before & (np.abs(frequency - first) > 0.5) & (np.abs(frequency - until) > 0.3)
    truth = np.interp(frequency[follows], f, a)
    return Sweep(
        rate,
        up,
        frequency,
        amplitude,
        jump,
        float(np.abs(amplitude[follows] / truth - 1).max(initial=0.0)),
    )


def at_rest(sweeps: list) -> float:
    """Extrapolate the two slowest sweeps to the frequency [Hz] of a jump at zero rate.

    The delay past a fold is proportional to the rate to the power 2/3 (Haberman 1979).
    """
    fast, slow = sorted(sweeps, key=lambda s: -s.rate)[-2:]
    return slow.jump - (fast.jump - slow.jump) / ((fast.rate / slow.rate) ** (2 / 3) - 1)
