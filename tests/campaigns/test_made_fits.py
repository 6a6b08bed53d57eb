"""Fits to made data with noise: 90 to 99 % of the 95 % intervals hold the true values.

A kind of fit and a seed make:

- loop: a friction loop of two cycles of a sine of 10 um with 80 rows each, of law elastic-plastic (even seed) or of bonds of
  constant length (odd seed), from closed forms, with noise of 3 % of the peak force; coefficient of
  friction 0.1 to 0.6, bond length 0.5 to 8 um (log-uniform). Both values are fitted, each in a range around it.
- curve: frequency and damping against amplitude of a block of 1 kg at 100 Hz on an Iwan joint (`backbone`, balance) at nine
  amplitudes, with noise of 3 % of the damping ratio and 0.03 % of the frequency, which the table states as errors; stiffness
  of the joint 0.2 to 2 times that of the block, chi -0.8 to -0.1. Both are fitted.
- rows: acceleration and displacement of a rig on an elastic-plastic point beside a bonded spring, marched to its steady
  state under six sines, with noise of 3 % (log-normal); coefficient of friction 0.35 to 0.6, spring 1.5 to 4 N/um. Both are
  fitted.
- wear: mean depth of a tilted, coated patch after 1e5 cycles, with normal noise of 10 %, which its interval states;
  coefficient 5e-16 to 2e-14 m^2/N (log-uniform).

Seeds 108000 to 108009 of each kind were fixed before the first fit with them and are scored once (tests/README.md), as
were 8800 to 8829, 99180000 to 99180029, 99190000 to 99190009 and 99282000 to 99282009 of loops and curves. Seeds 108300 to
108309 of each kind are fixed for the search by bounded linear steps, and scored once, as are 20300101 to 20300110 and
20300201 to 20300250 of each kind. Seeds 108500 to 108509 of each kind are fixed before their first fit, too,
and so are 108600 to 108659 of loops, because 4 of 20 intervals of loops missed. Seeds 108700 to 108709 of each kind were
fixed before their first fit and scored once with ends of intervals that deviate by up to 10 % from the profile; seeds 108710
to 108719 are fixed for ends that deviate by 2.5 %, and scored once.

Run: PYTHONPATH=.:tests/support python tests/campaigns/test_made_fits.py KIND FIRST COUNT
"""

import sys
import tempfile
import time as clock
from pathlib import Path

import numpy as np
import pytest
from campaigns import Row
from friction_loops import dahl_force, elastic_plastic_force, write_loop
from measured_rows import write_rows
from scene_texts import COATED, COULOMB, DRIVE, KILOGRAM, POINT

import patchfem as pf
from patchfem.core import G_N

NOISE = 0.03
LOAD = 26 * 4.4482216152605  # 26 lbf, of the scene POINT [N]
UNITS = {
    "friction.static": "",
    "friction.bond_length": " m",
    "friction.stiffness": " N/m",
    "structure.bonded.stiffness": " N/m",
    "wear.coefficient": " m^2/N",
}
SLIDE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "100 Hz"\ncycles = 2\n'
RIG = POINT + (
    '[friction]\nlaw = "elastic-plastic"\nstatic = 0.4\nbond_length = "0.5 um"\n'
    '[structure]\nmoving_mass = "1.2 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\ndamping = 0.003\n'
    'slide = 1.0\n[structure.bonded]\nstiffness = "3e6 N/m"\ndamping = "900 N s/m"\n[drive]\nkind = "base"\n'
    'frequency = "143 Hz"\nacceleration = "5 g"\ncycles = 400\n'
)
WORN = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n' + COULOMB + SLIDE
WORN += '[wear]\ncoefficient = "3e-15 m^2/N"\ncycles = 100000\n'
DEPTH_NOISE = 0.1  # standard deviation of a measured depth over its value


def fit_keys(kind: str, scene: str, to, truth: dict, **options) -> list[Row]:
    """Fit keys, and return a row for each, with the distance to the end of its interval on the side of the truth.

    The ranges are from a fifth to five times each value.
    """
    free = {}
    for key, value in truth.items():
        ends = (-0.95, -0.02) if key == "friction.chi" else (value / 5, 5 * value)
        free[key] = tuple(f"{end!r}{UNITS.get(key, '')}" for end in ends)
    rows = []
    for key, found in pf.fit(scene, to=to, free=free, **options)["values"].items():
        value = found["value"]
        error = found["high"] - value if truth[key] > value else value - found["low"]
        rows.append(Row(f"{kind} {key}", value, error, 0.0, truth[key], 0.0))
    return rows


def draw_log(rng, low: float, high: float) -> float:
    """Draw from a log-uniform distribution."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def fit_loop(seed: int, rng, folder: Path) -> list[Row]:
    """Fit coefficient of friction and bond length to a loop with noise."""
    static = float(rng.uniform(0.1, 0.6))
    bond = draw_log(rng, 0.5e-6, 8e-6)
    time = np.arange(161) / 80 / 100
    slide = 10e-6 * np.sin(2 * np.pi * 100 * time)
    limit = static * LOAD
    compute_force = dahl_force if seed % 2 else elastic_plastic_force
    force = compute_force(slide, limit, bond) + NOISE * limit * rng.normal(size=time.size)
    path = write_loop(folder / "loop.csv", time, slide, force)
    law = "nonlocal" if seed % 2 else "elastic-plastic"
    text = POINT + f'[friction]\nlaw = "{law}"\nstatic = 0.3\nbond_length = "2 um"\n' + SLIDE
    truth = {"friction.static": static, "friction.bond_length": bond}
    return fit_keys("loop", text, path, truth)


def fit_backbone(seed: int, rng, folder: Path) -> list[Row]:
    """Fit stiffness and chi of an Iwan joint to its backbone with noise."""
    stiffness = draw_log(rng, 0.2, 2.0) * (200 * np.pi) ** 2
    chi = float(rng.uniform(-0.8, -0.1))
    scene = POINT + (
        f'[friction]\nlaw = "iwan"\nstatic = 0.3\nstiffness = "{stiffness!r} N/m"\nchi = {chi!r}\nbeta = 0.5\n'
    )
    scene += KILOGRAM.replace("143 Hz", "100 Hz") + DRIVE
    slip = 0.3 * LOAD / stiffness
    amplitudes = np.geomspace(0.05 * slip, 3 * slip, 9)
    curve = pf.backbone(scene, amplitudes=amplitudes, method="balance")
    amplitude, frequency, damping = (
        curve[f"balance_{name}"].values for name in ("amplitude", "frequency", "damping")
    )
    table = np.stack(
        [
            amplitude,
            frequency * (1 + NOISE / 100 * rng.normal(size=amplitude.size)),
            0.02 * NOISE * frequency,
            damping * (1 + NOISE * rng.normal(size=amplitude.size)),
            2 * NOISE * damping,
        ],
        axis=1,
    )
    path = folder / "curve.csv"
    head = "amplitude [m],frequency [Hz],frequency_error [Hz],damping,damping_error"
    np.savetxt(path, table, fmt="%.17g", delimiter=",", header=head, comments="")
    truth = {"friction.stiffness": stiffness, "friction.chi": chi}
    return fit_keys("curve", scene, path, truth)


def fit_rows(seed: int, rng, folder: Path) -> list[Row]:
    """Fit coefficient of friction and spring to rows of a rig with noise."""
    truth = {
        "friction.static": float(rng.uniform(0.35, 0.6)),
        "structure.bonded.stiffness": float(rng.uniform(1.5e6, 4e6)),
    }
    rows = []
    for frequency in (135.0, 143.0, 150.0):
        for level in (5.0, 7.0):
            sets = {key: f"{value!r}{UNITS[key]}" for key, value in truth.items()}
            sets |= {"drive.frequency": f"{frequency} Hz", "drive.acceleration": f"{level} g"}
            measures = pf.run(pf.load(RIG, **sets)).measures
            readings = [
                measures[name].value * np.exp(NOISE * rng.normal())
                for name in ("absolute_acceleration_peak", "relative_displacement_amplitude")
            ]
            rows.append((frequency, level * G_N, *readings, ""))
    return fit_keys("rows", RIG, write_rows(folder, rows), truth, starts=2)


def fit_wear(seed: int, rng, folder: Path) -> list[Row]:
    """Fit the wear coefficient to a mean depth with noise."""
    truth = {"wear.coefficient": draw_log(rng, 5e-16, 2e-14)}
    sets = {key: f"{value!r}{UNITS[key]}" for key, value in truth.items()}
    depth = pf.run(pf.load(WORN, **sets)).measures["worn_volume"].value / 12.7e-3**2
    measured = depth * (1 + DEPTH_NOISE * rng.normal())
    low, high = (measured + side * 1.96 * DEPTH_NOISE * depth for side in (-1, 1))
    return fit_keys("wear", WORN, f"worn_depth_mean={low!r} m..{high!r} m", truth)


KINDS = {"loop": fit_loop, "curve": fit_backbone, "rows": fit_rows, "wear": fit_wear}


@pytest.mark.parametrize(
    "kind, seeds",
    [
        ("loop", range(102, 114, 3)),
        pytest.param("curve", range(103, 133, 3), marks=pytest.mark.slow),
        pytest.param("rows", range(5), marks=pytest.mark.slow),
        pytest.param("wear", range(5), marks=pytest.mark.slow),
    ],
    ids=KINDS,
)
def test_always_intervals_hold_with_noise(kind, seeds, tmp_path):
    """At most one of ten intervals fails, besides one by chance of few fits, and the intervals are not far too wide."""
    rows = []
    for seed in seeds:
        rows += KINDS[kind](seed, np.random.default_rng(seed), tmp_path)
    assert len(rows) >= len(seeds)
    assert np.count_nonzero([not row.holds for row in rows]) <= 1 + len(rows) // 10
    distances = [row.true_error / row.error for row in rows]
    assert np.median(distances) > 0.15  # 0.34 for normal errors


def main(kind: str, first: int, count: int) -> None:
    """Print for each fitted value the key, the value, whether its interval holds, and distance over half-width."""
    for seed in range(first, first + count):
        begin = clock.process_time()
        with tempfile.TemporaryDirectory() as folder:
            rows = KINDS[kind](seed, np.random.default_rng(seed), Path(folder))
        seconds = clock.process_time() - begin
        for row in rows:
            distance = row.true_error / row.error
            print(
                seed,
                row.name,
                repr(row.value),
                row.error,
                row.holds,
                f"{distance:.3f} {seconds:.2f} s",
            )


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
