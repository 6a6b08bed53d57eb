"""Self-checks of a motion: friction force, loop area, amplitudes and energy balance.

In: `Evidence`. Out: Findings.
"""

from collections.abc import Iterator

import numpy as np

from patchfem.core import Outcome
from patchfem.runs.rig import engines

from .evidence import Evidence, parse_scene_number
from .finding import (
    CONTACT_RESIDUAL_TOL,
    CUBIC_QUADRATURE_TOL,
    EVALUATION_TOL,
    ROUTE_OF_LOWER_BOUND,
    ROUTE_OF_UPPER_BOUND,
    STATED_ERROR_FACTOR,
    Finding,
)

# Largest relative error of a peak between two of 40 samples per cycle of the fastest motion.
SAMPLED_PEAK_TOL = 0.05
LAWS_WITH_FRICTION_LIMIT = ("coulomb", "tanh", "elastic-plastic", "iwan", "bouc-wen", "convolution")
# Largest relative error of the equivalent damping if the cycles of the window differ slightly.
MAX_SLIP_CORRECTION = 0.05


def check_friction_harmonic(run: Evidence) -> Iterator[Finding]:
    """Compare the first harmonic of the friction force from the motion with that from samples.

    See `compute_force_balance` for both computations and the threshold. `equivalent_stiffness` is
    Re(F1/q1) by definition.
    """
    balance = run.balance
    if balance is None:
        return
    size = abs(balance.from_samples)
    yield Finding(
        "the first harmonic of the friction force",
        size,
        abs(balance.from_motion),
        balance.threshold,
        "N",
        "from the equation of motion of the scene",
        abs(balance.from_motion - balance.from_samples),
    )
    stiffness = run.value("equivalent_stiffness")
    if stiffness is not None and abs(balance.slide) > 0:
        expected = (balance.from_samples / balance.slide).real
        # The displacement is a divisor, so that its quadrature error enters in proportion.
        slack = (balance.threshold + CUBIC_QUADRATURE_TOL * size) / abs(balance.slide)
        yield Finding(
            "equivalent_stiffness",
            stiffness,
            expected,
            slack + STATED_ERROR_FACTOR * run.error("equivalent_stiffness"),
            "N/m",
        )


def check_friction_limit(run: Evidence) -> Iterator[Finding]:
    """Compare the peak friction force with the friction limit, static × load.

    Laws that can exceed the limit (lugre, growing bonds) are left out. For a Coulomb contact of
    rigid pieces that slips, the peak is at least kinetic × load. For an elastic-plastic contact
    that slides 4 bond lengths in a bench, it is static × load.
    """
    peak = run.value("friction_force_peak")
    if (
        peak is None
        or run.result.outcome
        is Outcome.GROWS  # The motion is unbounded, so that the error of the peak is unknown.
        or not run.has_plain_friction
        or run.scene["friction"]["law"] not in LAWS_WITH_FRICTION_LIMIT
    ):
        return
    friction = run.scene["friction"]
    static = parse_scene_number(friction["static"])
    limit = static * run.load
    threshold = CONTACT_RESIDUAL_TOL * limit + run.error("friction_force_peak")
    yield Finding(
        "friction_force_peak", peak, min(peak, limit), threshold, "N", ROUTE_OF_UPPER_BOUND
    )
    if run.result.patch is not None and (run.model.partial_slip or run.model.side == "lower"):
        return
    slip = run.value("slip_amplitude")
    length = parse_scene_number(friction.get("bond_length", "none"))
    lower_bound = None
    if (
        friction["law"] == "coulomb"
        and slip
        and run.result.outcome is not Outcome.STUCK
        and not run.model.partial_slip
    ):
        lower_bound = (parse_scene_number(friction.get("kinetic", static)) or 0.0) * run.load
    elif (
        friction["law"] == "elastic-plastic"
        and run.model.rig is None
        and length is not None
        and (run.number("slide", "amplitude") or 0.0) > 4 * length
    ):
        lower_bound = limit
    if lower_bound is not None:
        yield Finding(
            "friction_force_peak",
            peak,
            max(peak, lower_bound),
            EVALUATION_TOL * limit + threshold,
            "N",
            ROUTE_OF_LOWER_BOUND,
        )


def check_loop_area(run: Evidence) -> Iterator[Finding]:
    """Compare the loop area with a trapezoidal sum of force over displacement.

    The equivalent damping is compared as well: it is loop_area/(2 pi K A^2) with K and A of the
    first mode of the scene. If force and displacement are monotonic between two samples, the error
    of a step is at most |change of F| |change of q|/2; twice as much is allowed.
    """
    window = run.window
    area = run.value("loop_area")
    if window is None or area is None or not run.has_plain_friction:
        return
    if (
        run.model.rig is not None
        and engines.ENGINES[run.result.extra["engine"]].max_balance_error == np.inf
    ):
        return
    cycles = round((window.time[-1] - window.time[0]) * run.frequency)
    slide_change = np.diff(window.slide)
    force = window.force
    expected = float(np.sum(slide_change * (force[1:] + force[:-1]) / 2)) / cycles
    quadrature_error = float(np.sum(np.abs(slide_change) * np.abs(np.diff(force)))) / cycles
    sum_of_magnitudes = float(np.sum(np.abs(slide_change) * np.abs(force[1:]))) / cycles
    yield Finding(
        "loop_area",
        area,
        expected,
        quadrature_error
        + CUBIC_QUADRATURE_TOL * sum_of_magnitudes
        + STATED_ERROR_FACTOR * run.error("loop_area"),
        "J",
    )
    damping = run.value("equivalent_damping")
    modes = run.modes
    if (
        damping is None
        or modes is None
        or run.model.rig is None
        or run.result.outcome is not Outcome.STEADY
    ):
        return
    k = int(np.argmax(modes.omega > 0))
    amplitude = float(np.ptp(window.slide)) / 2
    if modes.slide[k] and amplitude > 0:
        stiffness = modes.mass * (modes.omega[k] / modes.slide[k]) ** 2
        expected = area / (2 * np.pi * stiffness * amplitude**2)
        slack = MAX_SLIP_CORRECTION + 2 * run.error("loop_area") / max(abs(area), 1e-300)
        yield Finding(
            "equivalent_damping",
            damping,
            expected,
            slack * abs(expected) + STATED_ERROR_FACTOR * run.error("equivalent_damping"),
        )


def check_motion_measures(run: Evidence) -> Iterator[Finding]:
    """Compare displacement amplitude and acceleration with sums over modal coordinates.

    Half the range of sum output_i z_i over the samples is at most the amplitude, and at most a few
    percent smaller; the same holds for the largest absolute acceleration. The acceleration at a
    sample follows from the equation of motion, output . z'' + a(t). The median over the samples is
    compared, because a friction force that jumps at a sample may have either value there.
    """
    modes = run.modes
    window = run.window
    rig = run.model.rig
    if (
        rig is None
        or modes is None
        or window is None
        or rig.modes.gauge is not None
        or rig.springs.is_nonlinear
    ):
        return
    if run.result.outcome in (Outcome.EXCEEDS_TRAVEL, Outcome.GROWS, Outcome.NOT_CONVERGED):
        return
    amplitude = run.value("relative_displacement_amplitude")
    peak = run.value("absolute_acceleration_peak")
    expected = float(np.ptp(window.modal @ modes.output)) / 2
    if amplitude is not None:
        yield Finding(
            "relative_displacement_amplitude",
            amplitude,
            expected,
            SAMPLED_PEAK_TOL * expected
            + STATED_ERROR_FACTOR * run.error("relative_displacement_amplitude"),
            "m",
        )
    largest = float(np.abs(window.acceleration).max())
    if peak is not None:
        slack = SAMPLED_PEAK_TOL * largest + STATED_ERROR_FACTOR * run.error(
            "absolute_acceleration_peak"
        )
        yield Finding(
            "absolute_acceleration_peak",
            peak,
            max(peak, largest),
            slack,
            "m/s2",
            "from the samples of the last cycles",
        )
    if run.balance is None or run.scene["drive"]["kind"] != "base":
        return
    drive = run.number("drive", "acceleration") * np.sin(2 * np.pi * run.frequency * window.time)
    friction = np.outer(window.force, modes.slide) / modes.mass
    modal_acceleration = (
        -np.outer(drive, modes.base)
        - friction
        - 2 * modes.zeta * modes.omega * window.modal_rate
        - modes.omega**2 * window.modal
    )
    recomputed = modal_acceleration @ modes.output + drive
    size = float(np.median(np.abs(recomputed)))
    yield Finding(
        "the median size of the acceleration",
        float(np.median(np.abs(window.acceleration))),
        size,
        SAMPLED_PEAK_TOL * size + 1e-4,
        "m/s2",
        "from the equation of motion of the scene",
        float(np.median(np.abs(window.acceleration - recomputed))),
    )


def check_energy_balance(run: Evidence) -> Iterator[Finding]:
    """Compare the residual of the energy balance of a bench with zero.

    Work = change of the stored energy + dissipated - created. A bench integrates all terms by the
    same rule, so that the residual falls with the number of steps. In the first run it is less than
    a hundredth of the exchanged energy.
    """
    residual = run.value("energy_balance")
    if residual is not None and run.model.rig is None:
        yield Finding(
            "energy_balance",
            residual,
            0.0,
            EVALUATION_TOL + STATED_ERROR_FACTOR * run.error("energy_balance"),
        )
