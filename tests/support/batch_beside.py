"""Comparison of the results of a batch with those of single runs of its cases."""

import numpy as np
import pytest

LOOPS = ("loop_area", "equivalent_damping", "friction_work")
# Measures that depend only on extremes and phasors, and so are bit-identical.
BITS = ("relative_displacement_amplitude", "relative_displacement_amplitude_steady")
# Measures that are differences of larger terms, with absolute errors of round-off size.
DIFFERENCES = ("drift_per_cycle", "energy_balance", "work_check")


def passed(found, case: int, name: str) -> float:
    """Return the work whose round-off a loop area has [J].

    It is friction force times sliding distance; for the damping, its ratio to 2 pi K A^2.
    """
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
    """Return the factor by which cancellation enlarges the round-off of the slip.

    It is the static displacement of the drive over the slip.
    """
    slip = found.values["slip_amplitude"][case]
    return max(1.0, 1e-6 / slip) if slip > 0 else 1.0


def held_against(cases, ones, many) -> None:
    """Assert that a batch equals single runs.

    Values and errors agree within 1e-12 and all texts are identical. Amplitudes and steady
    estimates are bit-identical; so are their errors, unless a coarser run supplies them.
    """
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
            # In these cases a coarser run supplies the error estimates.
            coarser = cases[case].friction.law == "iwan" or cases[case].patch is not None
            # With a patch, its frames split integration pieces.
            if name in BITS and cases[case].patch is None:
                for one, other in ((ones.values, many.values), (ones.errors, many.errors))[
                    : 1 if coarser else 2
                ]:
                    np.testing.assert_array_equal(
                        other[name][case], one[name][case], f"{case}, {name}"
                    )
            value = ones.values[name][case]
            bar = ones.errors[name][case]
            near = 1e-12 * conditioned(ones, case) * abs(value)
            if name in LOOPS:  # The round-off of a loop area scales with the work of all cycles.
                near += 1e-14 * passed(ones, case, name)
                # Frames split pieces whose energies are found by quadrature; differences reach
                # 1.4e-12.
                if cases[case].patch is not None:
                    near += 1e-12 * abs(value)
            # Sums in another order have another round-off, which either error estimate may include.
            if name in DIFFERENCES:
                # A patch has many more pieces per cycle.
                most = 1e-13 if cases[case].patch is None else 1e-12
                theirs = min(many.errors[name][case], most)
                near += max(bar, theirs, 1e-14) if np.isfinite(bar) else 1e-12
            elif name == "equivalent_stiffness" and cases[case].patch is not None:
                # The measure is a small component of the first harmonic of the force over the slip
                # amplitude.
                slip = ones.values["slip_amplitude"][case]
                near += 1e-12 * ones.values["friction_force_peak"][case] / slip if slip > 0 else 0.0
            elif name == "friction_force_peak" and "tangential_stiffness" in ones.values:
                # Stiff springs multiply the round-off of the displacement since each of them last
                # slipped.
                reach = (
                    ones.values["tangential_stiffness"][case] * ones.values["slip_amplitude"][case]
                )
                near += np.finfo(float).eps * reach
            elif name == BITS[1] and cases[case].patch is not None:
                near += 1e-6 * bar  # Extrapolation amplifies the round-off of the amplitudes.
            elif name == "acceleration_distortion":
                near += 1e-13  # Relative to the first harmonic: round-off of the phase omega t.
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
