"""Frequency and damping ratio of a released rig against its amplitude, with errors.

In: the Solution of a release and its coarse runs. Out: a `DecayCurve` whose errors include
those of the coarse runs and of the mesh. While the nodes of both meshes stick, their decays
agree, although both omit the dissipation by micro-slip. Therefore the error of the mesh is
computed from the static loops of its elements at the same amplitudes (`slip.mesh_correction`).
"""

from dataclasses import replace

import numpy as np

from ...compiled import load
from ...core import NotConverged, PatchfemError
from ...dynamics.harmonic import forces, quasi_static
from ...dynamics.march import models
from ...response.decay_curve import (
    MIN_HALF_SWING,
    DecayCurve,
    compute_swing_curve,
    find_turning_points,
    half_swings_between,
)
from ...response.errors import MAX_ORDER, error_of_change
from ...slip.mesh_correction import SPREAD_FACTOR, spread_elements
from ..patch import faces
from . import interface, numerics
from .solution import Solution
from .steady import balance

MOVING = (
    "the contact slides on grooves",
    "the normal load changes",
    "the strips of the patch slide independently of one another",
)
NO_LOOP = "the hysteresis loop of this friction law is not known without a computation in time"
NOT_STATIC = "no static curve of the mode was found at these amplitudes"
MAX_POINT_ERROR = 0.5  # largest relative error of a point of the curve
AMPLITUDES_PER_DECADE = 16  # amplitudes per decade at which the error of the mesh is computed


def compute_decay(raw: Solution) -> DecayCurve | None:
    """Return the decay curve of the output of a release, with errors; None if it has no points.

    Points whose error exceeds MAX_POINT_ERROR of their value are left out. The errors are those of the
    evaluation plus the changes in the coarse runs at the same amplitudes; they are infinite outside
    the range of a coarse run.
    """
    found = _read(raw)
    if not found.time.size:
        return None
    found = _add_coarse_changes(found, raw)
    known = (found.frequency_error <= MAX_POINT_ERROR * found.frequency) & (
        found.damping_error <= MAX_POINT_ERROR * np.abs(found.damping)
    )
    return found.at(known) if known.any() else None


def _add_coarse_changes(found: DecayCurve, raw: Solution) -> DecayCurve:
    """Return the curve of a run with its differences from coarse runs added to the errors."""
    for run, beside in raw.coarser:
        one = _read(run).over(found.amplitude)
        other = found if beside is None else _read(beside).over(found.amplitude)
        found = found.add_difference(one, other)
    return found


def _read(run: Solution) -> DecayCurve:
    """Return the decay curve of a run from its half swings, as long as they decrease.

    After the last slip, the curve is that of the strongest mode that rings, at each of its half
    swings: other modes ring at the same time, so that the turning points of their sum belong to
    none of them.
    """
    motion = run.response
    held = run.extra.get("tail")
    found = compute_swing_curve(
        half_swings_between(*find_turning_points(motion.time, motion.output, motion.output_rate))
    )
    if held is None:
        return found
    time = np.arange(held.begin, held.end, 0.5 / held.frequency)
    rate = 2 * np.pi * held.frequency * held.damping / np.sqrt(1 - held.damping**2)
    size = held.displacement * np.exp(-rate * (time - held.begin))
    still = np.zeros(time.size)
    kept = size > MIN_HALF_SWING * np.abs(motion.output).max()
    rings = DecayCurve(time, size, still + held.frequency, still, still + held.damping, still).at(
        kept
    )
    return DecayCurve(*map(np.concatenate, zip(found.at(found.time < held.begin), rings)))


def laws_on(model, patch, meshed: tuple = ()):
    """Return the `harmonic.forces.LawGroup` of a rig on one of its meshes.

    Parameters
    ----------
    model : Model
    patch : Patch or None
        Patch of its [contact].
    meshed : tuple
        Indices of interfaces whose own patches are those on a coarser mesh.

    Raises
    ------
    PatchfemError
        If a law has no steady loop.
    """
    rig = model.rig
    if len(rig.friction.interfaces) < 2:
        return balance.BalanceFinder(
            model, replace(numerics.choose(with_automatic_method(model)), meshed=meshed), patch
        ).group
    load("dynamics.harmonic.cycle_kernels", None)
    return forces.LawGroup(
        rig.modes, list(enumerate(map(models.element_model, interface.own_elements(model, meshed))))
    )


def coarse_laws(model, coarse) -> list:
    """Return a list of LawGroups, in each of which another patch has a coarser mesh.

    coarse: Patch of its [contact] on a coarser mesh, or None.
    """
    return [
        *([] if coarse is None else [laws_on(model, coarse)]),
        *(laws_on(model, None, numbers) for numbers in faces.interfaces_with_coarse_mesh(model)),
    ]


def with_automatic_method(model):
    """Return the model with the automatic choice of the method."""
    return replace(model, accuracy=model.accuracy.model_copy(update={"method": "auto"}))


def static_rows(modes, laws, number: int, amplitudes, samples: int) -> np.ndarray:
    """Return amplitude, frequency, damping and loss (4, k) of a mode by static loading.

    Parameters
    ----------
    modes
        Modal basis.
    laws : LawGroup
    number : int
        Index of the mode, along which the static force acts.
    amplitudes : (k,)
        Amplitudes of the output [m].
    samples : int
        Samples of a cycle.

    Returns
    -------
    (4, k) array
        Amplitude [m], frequency [Hz], damping ratio [1], and loss per cycle [J].
    """
    held = modes.compute_stuck_mode(laws.rows, laws.stiffness(), number)
    moved = float(modes.output @ held[1])
    return decay_rows(
        modes,
        quasi_static.find_static_motions(
            modes, laws, amplitudes / abs(moved), held, samples, modes.output / moved
        ),
    )


def decay_rows(modes, found: list) -> np.ndarray:
    """Return output amplitude [m], frequency [Hz], damping and loss [J] (4, k) of `StaticMotion`s."""
    return np.array(
        [
            (abs(float(modes.output @ one.z)), one.omega / (2 * np.pi), one.zeta, one.loss)
            for one in found
        ]
    ).T


def mesh_error(fine, rough, read) -> np.ndarray:
    """Return the error due to the mesh of the values that read(LawGroup) returns, for partial slip.

    It follows from the change on a coarser mesh at second order. It is not less than the change if
    the elements are spread over the yield slides between the nodes (`slip.mesh_correction`): at a
    slide at which no node slips, a coarser mesh changes nothing.

    Parameters
    ----------
    fine : LawGroup
        Laws on the mesh of the run.
    rough : list of LawGroup
        Laws with a coarser mesh of one patch after the other.
    read : callable
        Function of a LawGroup that returns an array.
    """
    best = read(fine)
    changes = (read(other) - best for other in rough)
    by_meshes = sum(error_of_change(change, order=MAX_ORDER) for change in changes)
    return np.fmax(SPREAD_FACTOR * np.abs(read(fine.with_elements(_spread)) - best), by_meshes)


def _spread(stiffness, slide) -> tuple:
    """Return `slip.mesh_correction.spread_elements` of elements in any order."""
    order = np.argsort(slide, kind="stable")
    return spread_elements(stiffness[order], slide[order])


def mesh_errors_of_decay(model, patch, coarse, amplitudes, mode) -> tuple:
    """Return the errors of frequency [Hz] and damping due to the mesh at amplitudes of the output.

    Parameters
    ----------
    model : Model
    patch, coarse : Patch or None
        Patch of the [contact] of the rig, and the same on a coarser mesh.
    amplitudes : (k,)
        Increasing amplitudes of the output [m]. The errors are interpolated between those that have
        a static motion.
    mode : callable
        Function of a LawGroup that returns the index of the mode.

    Returns
    -------
    tuple
        Errors (2, k), and the reason why they are not known, else "". They are 0 without a patch
        that slips in part, and if they are not known.
    """
    rig = model.rig
    none = np.zeros((2, len(amplitudes)))
    if not (model.partial_slip or rig.friction.has_partial_slip):
        return none, ""
    moves = (model.grooves is not None, rig.friction.load_varies, rig.friction.strips_slide_apart)
    if any(moves):
        return none, MOVING[moves.index(True)]
    try:
        fine = laws_on(model, patch)
        number = mode(fine)
        error = mesh_error(
            fine,
            coarse_laws(model, coarse),
            lambda laws: static_rows(rig.modes, laws, number, amplitudes, balance.SAMPLES)[1:3],
        )
    except NotConverged as reason:
        return none, str(reason)
    except PatchfemError:
        return none, NO_LOOP
    known = np.isfinite(error).all(axis=0)
    if not known.any():
        return none, NOT_STATIC
    return np.array(
        [np.interp(np.log(amplitudes), np.log(amplitudes[known]), one[known]) for one in error]
    ), ""


def left_by_mesh_on(amplitude, frequency: float, model, patch, coarse) -> tuple:
    """Return `mesh_errors_of_decay` at many amplitudes for the stuck mode nearest to a frequency.

    Parameters
    ----------
    amplitude : (k,)
        Amplitudes of the output [m].
    frequency : float
        [Hz].
    model : Model
    patch, coarse : Patch or None
        See `mesh_errors_of_decay`.
    """
    low, high = np.log10([amplitude.min(), amplitude.max()])
    at = np.logspace(low, high, 2 + int(AMPLITUDES_PER_DECADE * (high - low)))
    wide, why = mesh_errors_of_decay(
        model, patch, coarse, at, lambda laws: _mode(model.rig.modes, laws, frequency)
    )
    return np.array([np.interp(np.log(amplitude), np.log(at), one) for one in wide]), why


def slip_sentences(whys: dict, ways) -> list:
    """Return sentences on errors to which `mesh_errors_of_decay` could not be added.

    Parameters
    ----------
    whys : dict
        Reason, or "", by the name of what has these errors.
    ways : callable
        Returns the `CoarserRuns` in space that contribute to them.
    """
    out = []
    for why in dict.fromkeys(filter(None, whys.values())):
        whose = " and of ".join(name for name, one in whys.items() if one == why)
        lacks = (
            "the change on a coarser mesh, but not the energy that is lost in slip too small for either mesh to "
            "resolve"
            if any(one.of == "mesh" for one in ways())
            else "no error of the mesh"
        )
        out.append(f"the errors of {whose} include {lacks}, because {why}")
    return out


def _mode(modes, laws, frequency: float) -> int:
    """Return the index of the stuck mode that moves the output and is nearest to a frequency."""
    held = [
        modes.compute_stuck_mode(laws.rows, laws.stiffness(), k) for k in range(modes.omega.size)
    ]
    return int(
        np.argmin(
            [
                abs(omega / (2 * np.pi) - frequency) if modes.output @ shape else np.inf
                for omega, shape in held
            ]
        )
    )
