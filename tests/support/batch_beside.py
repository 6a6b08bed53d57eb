"""Comparison of the results of a batch with those of single runs of its cases."""

import numpy as np
import pytest

LOOPS = ("loop_area", "equivalent_damping", "friction_work")
# Measures that depend only on extremes and phasors, and so are bit-identical.
BITS = ("relative_displacement_amplitude", "relative_displacement_amplitude_steady")
# Measures that are differences of larger terms, with absolute errors of round-off size.
DIFFERENCES = ("drift_per_cycle", "energy_balance", "work_check")


def round_off_scale(answers, case: int, name: str) -> float:
    """Return the work whose round-off a loop area has [J].

    It is friction force times sliding distance; for the damping, its ratio to 2 pi K A^2.
    """
    work = (
        40
        * answers.values["friction_force_peak"][case]
        * answers.values["relative_displacement_amplitude"][case]
    )
    loop = answers.values["loop_area"][case]
    if name == "equivalent_damping":
        return abs(answers.values[name][case] / loop) * work if loop else 1.0
    return work


def round_off_factor(answers, case: int) -> float:
    """Return the factor by which cancellation enlarges the round-off of the slip.

    It is the static displacement of the drive over the slip.
    """
    slip = answers.values["slip_amplitude"][case]
    return max(1.0, 1e-6 / slip) if slip > 0 else 1.0


def assert_equal_to_single_runs(cases, singles, batch) -> None:
    """Assert that a batch equals single runs.

    Values and errors agree within 1e-12 and all texts are identical. Amplitudes and steady
    estimates are bit-identical; so are their errors, unless a coarser run supplies them.
    """
    assert list(batch.outcome) == list(singles.outcome)
    assert (
        batch.warnings == singles.warnings
        and batch.notes == singles.notes
        and batch.numerics == singles.numerics
    )
    for case in range(len(cases)):
        for name in {*singles.values, *batch.values}:
            assert batch.has(name, case) == (name in singles.values and singles.has(name, case)), (
                case,
                name,
            )
            assert batch.reasons.get(name, {}).get(case) == singles.reasons.get(name, {}).get(
                case
            ), (
                case,
                name,
            )
            if not singles.has(name, case):
                continue
            # In these cases a coarser run supplies the error estimates.
            coarser = cases[case].friction.law == "iwan" or cases[case].patch is not None
            # With a patch, its frames split integration pieces.
            if name in BITS and cases[case].patch is None:
                for one, other in ((singles.values, batch.values), (singles.errors, batch.errors))[
                    : 1 if coarser else 2
                ]:
                    np.testing.assert_array_equal(
                        other[name][case], one[name][case], f"{case}, {name}"
                    )
            value = singles.values[name][case]
            bar = singles.errors[name][case]
            tolerance = 1e-12 * round_off_factor(singles, case) * abs(value)
            if name in LOOPS:  # The round-off of a loop area scales with the work of all cycles.
                tolerance += 1e-14 * round_off_scale(singles, case, name)
                # Frames split pieces whose energies are found by quadrature; differences reach
                # 1.4e-12.
                if cases[case].patch is not None:
                    tolerance += 1e-12 * abs(value)
            # Sums in another order have another round-off, which either error estimate may include.
            if name in DIFFERENCES:
                # A patch has many more pieces per cycle.
                max_error = 1e-13 if cases[case].patch is None else 1e-12
                batch_error = min(batch.errors[name][case], max_error)
                tolerance += max(bar, batch_error, 1e-14) if np.isfinite(bar) else 1e-12
            elif name == "equivalent_stiffness" and cases[case].patch is not None:
                # The measure is a small component of the first harmonic of the force over the slip
                # amplitude.
                slip = singles.values["slip_amplitude"][case]
                tolerance += (
                    1e-12 * singles.values["friction_force_peak"][case] / slip if slip > 0 else 0.0
                )
            elif name == "friction_force_peak" and "tangential_stiffness" in singles.values:
                # Stiff springs multiply the round-off of the displacement since each of them last
                # slipped.
                elastic_force = (
                    singles.values["tangential_stiffness"][case]
                    * singles.values["slip_amplitude"][case]
                )
                tolerance += np.finfo(float).eps * elastic_force
            elif name == BITS[1] and cases[case].patch is not None:
                tolerance += 1e-6 * bar  # Extrapolation amplifies the round-off of the amplitudes.
            elif name == "acceleration_distortion":
                tolerance += (
                    1e-13  # Relative to the first harmonic: round-off of the phase omega t.
                )
            assert batch.floors[name][case] == pytest.approx(
                singles.floors[name][case], rel=1e-9
            ), name
            assert batch.values[name][case] == pytest.approx(
                value, rel=0, abs=tolerance, nan_ok=True
            ), (
                case,
                name,
            )
            if name not in DIFFERENCES:
                error_tolerance = 1e-9 * tolerance
                if coarser:
                    error_tolerance = 3 * tolerance
                expected_error = pytest.approx(bar, rel=1e-11, abs=error_tolerance, nan_ok=True)
                assert batch.errors[name][case] == expected_error, (case, name)
