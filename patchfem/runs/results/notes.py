"""Warnings and notes of a bench or a rig on its friction law.

In: a `rig.CoupledRun`. Out: sentences. LAW_WARNINGS and LAW_NOTES are their tables: each entry is a condition on the
run with its sentence and, if there is one, the remedy with its value.
"""

from collections.abc import Iterator
from math import ceil, log2

import numpy as np

from ... import friction
from ...core import Outcome, max_abs
from ...effects import law_has_trait
from ...formatting import format_length, format_quantity

# Largest relative difference of the friction works from samples and from energies without a
# warning.
MAX_WORK_CHECK = 1e-3
# Largest ratio of the slip during the formation of a bond to the bond length without a warning.
MAX_BOND_FORMING_SLIP_RATIO = 0.3
# Largest ratio of the slip in one time step to the slide of the holders in it without a warning of a sudden slip.
MAX_SLIP_PER_SLIDE = 10.0
MAX_PROPOSED_HALVINGS = 8  # Largest number of halvings of the time step that a warning proposes.


def _warn_of_infinite_traction(run) -> Iterator[str]:
    """Warn of initial bonds whose traction is infinite at first, because the order is negative.

    Bonds that form later carry at most the fraction P(p + 1, R/eps_0) of mu_s N, with or without growth.
    """
    law = find_bonds(run.model)
    if law is not None and law.order < 0 and law.initial != 0:
        yield (
            "friction.order below 0 with friction.initial_bonds: the traction is infinite at the first instant, so "
            "friction peaks depend on the time step; set initial_bonds = 0"
        )


def _warn_of_slow_forming(run) -> Iterator[str]:
    """Warn of a law as printed in the 1985 report whose bonds slide far while they form.

    The limit is MAX_BOND_FORMING_SLIP_RATIO of the bond length; beyond it the printed law differs from its own equations.
    """
    law = find_bonds(run.model)
    if law is None or law.reading != "report":
        return
    speed = max_abs(run.solution.run.window.slide_rate)
    ratio = friction.bonds.parameters.growth_path_ratio(law, speed)
    if ratio > MAX_BOND_FORMING_SLIP_RATIO:
        # At this growth path, growth_path_ratio(law, speed) equals MAX_BOND_FORMING_SLIP_RATIO.
        max_growth_path = law.ratio / (
            1 / (MAX_BOND_FORMING_SLIP_RATIO * law.length) - law.growth.rest_growth / speed**2
        )
        yield (
            f"at the peak speed of {speed:.3g} m/s a bond slides by {ratio:.2g} of its length while it forms (limit "
            f"{MAX_BOND_FORMING_SLIP_RATIO:g}), so the law as printed in the report gives less friction than eqs. "
            f'2.18-2.21; set friction.slip_growth = "{0.95e6 * max_growth_path:.2g} um", or friction.reading = "stretch"'
        )


def _warn_of_creep(run) -> Iterator[str]:
    """Warn of a mean position that moves on in each cycle of a bounded motion (creep under a mean force, as in Dahl's law).

    The drift is a property of the law, not of the joint.
    """
    law = find_bonds(run.model)
    drift = run.measures.get("drift_per_cycle")
    is_bounded = run.outcome in (Outcome.STEADY, Outcome.STUCK)
    if law is None or law.reading != "stretch" or drift is None or drift.error is None:
        return
    if is_bounded and abs(drift.value) > drift.error + 1e-2 * law.length:
        yield (
            f"the mean position creeps by {drift.value / law.length:.2g} bond lengths per cycle, because bonds damaged "
            "in each cycle creep under a force with a nonzero mean"
        )


def _warn_of_created_energy(run) -> Iterator[str]:
    """Warn if the law as printed in the 1985 report created energy: more than a fraction of the work that was exchanged."""
    friction = run.model.friction
    if friction is None or friction.reading != "report":
        return
    created = run.solution.run.ledger.get("created", 0.0)
    exchanged = run.solution.run.ledger.get("passed", 0.0)
    # Largest ratio of created to exchanged energy without a warning.
    if created > 1e-6 * exchanged:
        percent = 100 * created / exchanged
        yield (
            f"the law as printed in the report created {created:.3g} J, which is {percent:.2g} % of the work "
            'exchanged; with friction.reading = "stretch" no energy is created'
        )


def _warn_of_sudden_slip(run) -> Iterator[str]:
    """Warn of a contact that jumps within a time step, because its force falls more steeply than pieces and holder relax.

    The slip then exceeds the bond length, while the holders hardly move. Without mass nothing else limits its speed.
    """
    law = find_bonds(run.model)
    if law is None or not law.has_growth or not run.model.partial_slip:
        return
    # The samples of a rig are its time steps only in the last cycles.
    histories = run.solution.run.response if run.model.rig is None else run.solution.run.window
    slips = np.abs(np.diff(histories.slip))
    slides = np.abs(np.diff(histories.slide))
    is_sudden = slips > np.maximum(law.length, MAX_SLIP_PER_SLIDE * slides)
    if not is_sudden.any():
        return
    step = int(np.argmax(slips * is_sudden))
    end = format_quantity(float(histories.time[step + 1]), "s", 3)
    slip = format_length(slips[step], 3)
    slide = format_length(slides[step], 3)
    length = format_length(law.length, 3)
    yield (
        f"the contact jumps within a time step: in the one that ends at {end} it slips by {slip}, more than the bond length "
        f"of {length}, while its holders slide by {slide} (limit {MAX_SLIP_PER_SLIDE:g} times this slide), because the "
        "friction force falls more steeply than the pieces and the holder relax; no mass limits the speed of such a slip; "
        "raise friction.bond_length or friction.kinetic, or make the holder stiffer"
    )


def _warn_of_kept_pressure(run) -> Iterator[str]:
    """Warn that bonds of the printed law keep the pressure at which they formed, on a bench whose load varies."""
    model = run.model
    if model.rig is None and model.load_varies and model.friction.reading == "report":
        yield (
            "in the law as printed in the report, a bond keeps the pressure at which it formed, "
            "so while the load falls the friction force may exceed mu_s N; set friction.reading "
            '= "stretch" to avoid this'
        )


def _warn_of_work_check(run) -> Iterator[str]:
    """Warn if the sampled friction work differs from that in the energies.

    The trapezoidal rule for the samples is of second order. A difference below the error of the
    rule may be small by chance, so that the larger of both is used.
    """
    check = run.measures.get("work_check")
    if check is None or check.value is None or check.value <= MAX_WORK_CHECK:
        return
    ratio = max(check.value, check.error or 0.0) / MAX_WORK_CHECK
    steps = run.settings.steps_per_cycle
    # One more halving of the time step is proposed, because in a motion with stick the difference
    # of the two works is of second order in the step only on average.
    halvings = 1 + ceil(log2(ratio) / 2)
    if steps and halvings > MAX_PROPOSED_HALVINGS:
        remedy = f"with this method {steps} steps per cycle are too few for this motion"
    elif steps:
        remedy = f"set accuracy.steps_per_cycle = {steps * 2**halvings}"
    else:
        remedy = 'compare with a run with accuracy.method = "march"'
    yield (
        f"work_check is {check.value:.2g} (limit {MAX_WORK_CHECK:g}): the friction work computed from the samples by the "
        f"trapezoidal rule differs from the friction work in the energy balance; {remedy}"
    )


def _note_on_growth(run) -> Iterator[str]:
    """Note on a bond length that grows during the run.

    In the law as printed in the 1985 report only bonds that form during the motion have the grown length, not the
    initial ones. In the other reading of the law, older bonds pull harder as the length grows, so that friction may
    exceed mu_s N.
    """
    law = find_bonds(run.model)
    if law is None or not law.has_growth:
        return

    # In the reading of the report, growth changes only the bonds that form later.
    if law.reading == "report":
        if law.initial:
            yield (
                "in the law as printed in the report, the initial bonds keep the bond length eps_0, even though the length "
                "of later bonds grows"
            )
        return

    # In the other reading, bonds of a short length pull harder as the length grows.
    if law.order > 1:
        yield (
            f"with friction.order = {law.order:g} and a growing bond length, friction has no limit: as the bond "
            "length grows, a bond that formed while the length was small pulls harder and breaks later; set "
            "friction.order <= 1 to keep friction near mu_s N"
        )
    force_ratio = run.find_force_ratio()
    # Smallest excess of the friction force over mu_s N, relative to it, that a note reports.
    if force_ratio > 1 + 1e-3:
        yield (
            f"the friction force reaches {force_ratio:.3g} times mu_s N: the bond length grows during the run, and "
            "bonds that formed while the bond length was small then break later; to keep the friction force at "
            'or below mu_s N, set friction.reading = "report" and friction.order <= 0'
        )


def _note_on_groove_slope(run) -> Iterator[str]:
    """Note that the slope of grooves is the same for all points of pieces that deform in shear.

    It is taken at the displacement of the holders. The note states how far a point may be from this displacement.
    """
    model = run.model
    if model.grooves is None or not model.partial_slip:
        return
    patch = run.patch
    limit = model.friction.static * patch.pressure.sigma_n * patch.pieces.interface.weight
    max_lag = float((patch.slip_compliance @ limit).max())
    yield (
        f"{model.partial_slip} with grooves: the height and the slope of the grooves are taken at the slide of the holders "
        "and are the same for all points; a point at its friction limit slides by up to "
        f"{format_length(max_lag, 3)} less than "
        f"the holders, which is {max_lag / model.grooves.wavelength:.2g} of the wavelength; the normal force at each "
        "point is in proportion to the total load"
    )


def _note_on_rigid_pieces(run) -> Iterator[str]:
    """Note that the stiffness of the pieces has no effect on a motion that treats them as rigid in shear."""
    model = run.model
    has_friction = model.friction is not None and model.friction.static > 0
    if run.patch is not None and has_friction and not model.partial_slip:
        yield (
            "tangential_stiffness is that of the pieces while the whole patch sticks; the motion does not use it, because "
            "pieces are rigid in shear without [contact.shear]"
        )


LAW_WARNINGS = (
    _warn_of_infinite_traction,
    _warn_of_slow_forming,
    _warn_of_creep,
    _warn_of_sudden_slip,
    _warn_of_kept_pressure,
    _warn_of_created_energy,
    _warn_of_work_check,
)
LAW_NOTES = (_note_on_growth, _note_on_groove_slope, _note_on_rigid_pieces)


def find_bonds(model):
    """Return the parameters of a law with bonds; None for other laws."""
    friction = model.friction
    has_bonds = friction is not None and law_has_trait(friction.law, "bonds")
    return model.bonds if has_bonds else None
