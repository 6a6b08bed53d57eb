"""Warnings and notes of a run on its friction law.

In: a model, its histories and measures. Out: lists of sentences.
"""

from math import ceil, log2

from ...core import Outcome
from ...effects import law_has_trait
from ...formatting import format_length
from ...friction.bonds import parameters
from .patch_rows import Measures
from .result import Advice

# Largest relative difference of the friction works from samples and from energies without a
# warning.
MAX_WORK_CHECK = 1e-3
# Largest ratio of created to exchanged energy without a warning.
MAX_CREATED_FRACTION = 1e-6
# Largest ratio of the slip during the formation of a bond to the bond length without a warning.
MAX_FORMING_RATIO = 0.3
# Smallest excess of the friction force over mu_s N, relative to it, that a note reports.
MIN_EXCESS_RATIO = 1e-3
MAX_PROPOSED_HALVINGS = 8  # Largest number of halvings of the time step that a warning proposes.
HARMONICS_FACTOR = 4  # Ratio of the proposed to the present number of harmonics.
MIN_PROPOSED_HARMONICS = 31  # Smallest number of harmonics that a warning proposes.
# Largest number of harmonics that a warning proposes for a steep friction law.
MAX_PROPOSED_HARMONICS = 500


def note_on_groove_slope(model, patch) -> list[str]:
    """Return a list with a note on grooves under pieces that are compliant in shear.

    All points take the slope of the grooves at the displacement of the holders. The note reports
    how far a point may be from this displacement.
    """
    if model.grooves is None or not model.partial_slip:
        return []
    limit = model.friction.static * patch.pressure.sigma_n * patch.pieces.interface.weight
    max_lag = float((patch.slip_compliance @ limit).max())
    return [
        f"{model.partial_slip} with grooves: the height and the slope of the grooves are taken at the slide of the holders "
        "and are the same for all points; a point at its friction limit slides by up to "
        f"{format_length(max_lag, 3)} less than "
        f"the holders, which is {max_lag / model.grooves.wavelength:.2g} of the wavelength; the normal force at each "
        "point is in proportion to the total load"
    ]


def warn_of_bonds(model, speed: float, measures: Measures, outcome: Outcome) -> list[str]:
    """Return warnings on a bond law whose bonds break before they form, creep, or start with an infinite traction.

    Parameters
    ----------
    model : Model
        Model of a bench or a rig.
    speed : float
        Peak speed [m/s].
    measures : dict
        Measures by name.
    outcome : Outcome
        How the motion ended; a bounded motion may creep.
    """
    if not law_has_trait(model.friction.law, "bonds"):
        return []
    law = model.bonds
    warnings = []

    # The traction of the initial bonds is infinite at first if the order is negative. Bonds that form later carry at
    # most the fraction P(p + 1, R/eps_0) of mu_s N, with or without growth.
    if law.order < 0 and law.initial != 0:
        warnings.append(
            "friction.order below 0 with friction.initial_bonds: the traction is infinite at the first instant, so "
            "friction peaks depend on the time step; set initial_bonds = 0"
        )

    forming_ratio = parameters.growth_path_ratio(law, speed) if law.reading == "report" else 0.0
    if forming_ratio > MAX_FORMING_RATIO:
        # At this growth path, growth_path_ratio(law, speed) equals MAX_FORMING_RATIO.
        max_growth_path = law.ratio / (
            1 / (MAX_FORMING_RATIO * law.length) - law.rest_growth / speed**2
        )
        warnings.append(
            f"at the peak speed of {speed:.3g} m/s a bond slides by {forming_ratio:.2g} of its length while it forms (limit "
            f"{MAX_FORMING_RATIO:g}), so the law as printed in the report gives less friction than eqs. 2.18-2.21; set "
            "friction.slip_growth = "
            f'"{0.95e6 * max_growth_path:.2g} um", or friction.reading = "stretch"'
        )

    # The drift of a bounded motion (Dahl's creep) is a property of the law, not of the joint.
    drift = measures.get("drift_per_cycle")
    is_bounded = outcome in (Outcome.STEADY, Outcome.STUCK) and law.reading == "stretch"
    if drift is None or drift.error is None or not is_bounded:
        return warnings
    if abs(drift.value) > drift.error + 1e-2 * law.length:
        warnings.append(
            f"the mean position creeps by {drift.value / law.length:.2g} bond lengths per cycle, because bonds damaged "
            "in each cycle creep under a force with a nonzero mean"
        )
    return warnings


def note_on_growth(model, peak: float | None) -> list[str]:
    """Return notes on the effects of growing bonds.

    peak: largest ratio of friction force to mu_s N in the run; None if the load varies.
    """
    law = model.bonds if law_has_trait(model.friction.law, "bonds") else None
    if law is None or not law.has_growth:
        return []
    if law.reading == "report" and law.initial == 0:
        return []

    # In the reading of the report, growth changes only the bonds that form later.
    if law.reading == "report":
        return [
            "in the law as printed in the report, the initial bonds keep the bond length eps_0, even though the length "
            "of later bonds grows"
        ]

    # In the other reading, bonds of a short length pull harder as the length grows.
    notes = []
    if law.order > 1:
        notes.append(
            f"with friction.order = {law.order:g} and a growing bond length, friction has no limit: as the bond "
            "length grows, a bond that formed while the length was small pulls harder and breaks later; set "
            "friction.order <= 1 to keep friction near mu_s N"
        )

    if peak is not None and peak > 1 + MIN_EXCESS_RATIO:
        notes.append(
            f"the friction force reaches {peak:.3g} times mu_s N: the bond length grows during the run, and "
            "bonds that formed while the bond length was small then break later; to keep the friction force at "
            'or below mu_s N, set friction.reading = "report" and friction.order <= 0'
        )
    return notes


def warn_of_work_check(
    values: Measures, steps: int | None, harmonics: int | None = None
) -> list[str]:
    """Return a list with a warning if sampled friction work differs from that in the energies.

    The trapezoidal rule for the samples is of second order. A difference below the error of the
    rule may be small by chance, so that the larger of both is used.

    Parameters
    ----------
    values : dict
        Measures by name.
    steps, harmonics : int or None
        Steps per cycle and number of harmonics of the run; None for an engine without them.
    """
    check = values.get("work_check")
    if check is None or check.value is None or check.value <= MAX_WORK_CHECK:
        return []
    ratio = max(check.value, check.error or 0.0) / MAX_WORK_CHECK
    # One more halving of the time step is proposed, because in a motion with stick the difference
    # of the two works is of second order in the step only on average.
    halvings = 1 + ceil(log2(ratio) / 2)
    if harmonics:
        remedy = advise_harmonics(harmonics).text
    elif steps and halvings > MAX_PROPOSED_HALVINGS:
        remedy = f"with this method {steps} steps per cycle are too few for this motion"
    elif steps:
        remedy = f"set accuracy.steps_per_cycle = {steps * 2**halvings}"
    else:
        remedy = 'compare with a run with accuracy.method = "march"'
    return [
        f"work_check is {check.value:.2g} (limit {MAX_WORK_CHECK:g}): the friction work computed from the samples by the "
        f"trapezoidal rule differs from the friction work in the energy balance; {remedy}"
    ]


def advise_harmonics(n_harmonics: int, n_law_harmonics: float = 0.0) -> Advice:
    """Return the advice to use more harmonics in the harmonic balance.

    At least MIN_PROPOSED_HARMONICS are proposed, because the convergence of a balance with few
    harmonics is not known. n_law_harmonics: number of harmonics that the friction law needs.
    """
    n_needed = min(ceil(n_law_harmonics), MAX_PROPOSED_HARMONICS)
    n_proposed = max(HARMONICS_FACTOR * n_harmonics, MIN_PROPOSED_HARMONICS, n_needed)
    return Advice.set_key("accuracy.harmonics", n_proposed)


def warn_of_created_energy(model, created: float, exchanged: float) -> list[str]:
    """Return a list with a warning if the law of the 1985 report has created energy.

    Parameters
    ----------
    model : Model
        Model of a bench or a rig.
    created, exchanged : float
        Energy created, and integral of the absolute friction power [J].
    """
    if model.friction is None or model.friction.reading != "report":
        return []
    if created <= MAX_CREATED_FRACTION * exchanged:
        return []
    return [
        f"the law as printed in the report created {created:.3g} J, which is {100 * created / exchanged:.2g} % of the work "
        'exchanged; with friction.reading = "stretch" no energy is created'
    ]
