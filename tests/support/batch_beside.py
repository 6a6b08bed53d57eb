"""Answers of a batch held against those of single runs of its cases."""

import numpy as np
import pytest

LOOPS = ("loop_area", "equivalent_damping", "friction_work")
# by extremes and phasors alone
BITS = ("relative_displacement_amplitude", "relative_displacement_amplitude_steady")
# of larger terms: known to their round-off
DIFFERENCES = ("drift_per_cycle", "energy_balance", "work_check")


def passed(found, case: int, name: str) -> float:
    """Friction force times the slide of all cycles [J], or for the damping [1] the share of it in 2 pi K A^2."""
    size = (
        40
        * found.values["friction_force_peak"][case]
        * found.values["relative_displacement_amplitude"][case]
    )
    loop = found.values["loop_area"][case]
    if name == "equivalent_damping":
        return abs(found.values[name][case] / loop) * size if loop else 1.0
    return size


def conditioned(found, case: int) -> float:
    """How much round-off of the coordinate counts in the slip: static displacement of the drive over the slip."""
    slip = found.values["slip_amplitude"][case]
    return max(1.0, 1e-6 / slip) if slip > 0 else 1.0


def held_against(cases, ones, many) -> None:
    """Assert that a batch gave what single runs give: values and bars to 1e-12, all words the same, amplitudes and
    steady estimates to the last bit, and their bars but where a coarser run tells them."""
    assert list(many.outcome) == list(ones.outcome)
    assert (
        many.warnings == ones.warnings
        and many.notes == ones.notes
        and many.numerics == ones.numerics
    )
    for case in range(len(cases)):
        for name in {*ones.values, *many.values}:
            assert many.has(name, case) == (name in ones.values and ones.has(name, case)), (
                case,
                name,
            )
            assert many.reasons.get(name, {}).get(case) == ones.reasons.get(name, {}).get(case), (
                case,
                name,
            )
            if not ones.has(name, case):
                continue
            # whose run tells the bars
            coarser = cases[case].friction.law == "iwan" or cases[case].patch is not None
            if name in BITS and cases[case].patch is None:  # frames of a patch cut pieces in two
                for one, other in ((ones.values, many.values), (ones.errors, many.errors))[
                    : 1 if coarser else 2
                ]:
                    np.testing.assert_array_equal(
                        other[name][case], one[name][case], f"{case}, {name}"
                    )
            value = ones.values[name][case]
            bar = ones.errors[name][case]
            near = 1e-12 * conditioned(ones, case) * abs(value)
            if name in LOOPS:  # of the work that goes to and fro
                near += 1e-14 * passed(ones, case, name)
                # frames divide pieces, whose energies are by a rule: 1.4e-12 seen
                if cases[case].patch is not None:
                    near += 1e-12 * abs(value)
            # other orders of the same sums leave another round-off, which either bar may know
            if name in DIFFERENCES:
                most = 1e-13 if cases[case].patch is None else 1e-12  # of many more pieces a cycle
                theirs = min(many.errors[name][case], most)
                near += max(bar, theirs, 1e-14) if np.isfinite(bar) else 1e-12
            elif name == "equivalent_stiffness" and cases[case].patch is not None:
                # a small part of the first harmonic of the force over that
                slip = ones.values["slip_amplitude"][case]
                near += 1e-12 * ones.values["friction_force_peak"][case] / slip if slip > 0 else 0.0
            elif name == "friction_force_peak" and "tangential_stiffness" in ones.values:
                # stiff springs from a slide to where each last slipped: the last bit of the slide, times all of them
                reach = (
                    ones.values["tangential_stiffness"][case] * ones.values["slip_amplitude"][case]
                )
                near += np.finfo(float).eps * reach
            elif name == BITS[1] and cases[case].patch is not None:
                near += 1e-6 * bar  # extrapolation shows the last digits of the amplitudes
            elif name == "acceleration_distortion":
                near += 1e-13  # of the first harmonic: round-off of the phase omega t
            assert many.floors[name][case] == pytest.approx(ones.floors[name][case], rel=1e-9), name
            assert many.values[name][case] == pytest.approx(value, rel=0, abs=near, nan_ok=True), (
                case,
                name,
            )
            if name not in DIFFERENCES:
                told = 1e-9 * near
                if coarser:
                    told = 3 * near
                same = pytest.approx(bar, rel=1e-11, abs=told, nan_ok=True)
                assert many.errors[name][case] == same, (case, name)
