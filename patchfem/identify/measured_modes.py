"""Modes of a rig as a scene lists them, from a driven record, from a free decay, or from measured shapes."""

from dataclasses import dataclass, field

import numpy as np

from ..core import PatchfemError
from ..response.decay_curve import curve_of
from ..structure import places as structure_places
from ..structure.places import Shapes
from .decay import decay
from .driven_modes import POWER, SAMPLES, Modes, driven_modes
from .frequency_response import Estimate, even_step, h1
from .swings import half_swings, sparse_after

INPUTS = ("force", "base_acceleration")
PLACES = ("slide", "output", "base", "normal", "pitch")
# share by which the estimate's damping may lie above that of the record before it is said
WIDER = 0.05
WIDE = 2.0  # times a damping ratio, the half-width of an interval that tells nothing of it
LOOSE, LOOSE_DECAY = 0.1, 0.05  # shares of a record that the modes may leave over before it is said


@dataclass(frozen=True, eq=False, slots=True)
class Listed:
    """Modes of [[structure.mode]].

    frequency (n,) [Hz], damping (n,); rows: key of the table -> (n,); mass [kg] or None where the record does not tell
    it; about: n lines of words on each mode; notes: sentences on all; estimate: the frequency response, or None.
    """

    frequency: np.ndarray
    damping: np.ndarray
    rows: dict
    mass: float | None
    about: list
    notes: list = field(default_factory=list)
    estimate: Estimate | None = None


def response_of(values: dict) -> str:
    """The one response among records; PatchfemError where there is none or several."""
    found = [name for name in POWER if name in values]
    if len(found) != 1:
        raise PatchfemError(
            f"exactly one response is needed ({' or '.join(POWER)}), but the record has "
            f"{', '.join(found) or 'none'}: choose one with --map"
        )
    return found[0]


def estimated(values: dict, segment: float | None = None, window: str | None = None) -> tuple:
    """(estimate, step [s], input, response by name) of records with `time`; segment [s]. PatchfemError where one is
    lacking."""
    response, inputs = response_of(values), [name for name in INPUTS if name in values]
    if len(inputs) != 1 or "time" not in values:
        raise PatchfemError(
            "a frequency response needs time, a response and one input (force or base_acceleration), "
            "but the record "
            "has " + ", ".join(values) + ": choose channels with --map, or use --decay for a free "
            "decay"
        )
    step = even_step(values["time"])
    count = None if segment is None else round(segment / step)
    return h1(step, values[inputs[0]], values[response], count, window), step, inputs[0], response


def of_drive(values: dict, segment: float | None, window: str | None, band: tuple) -> Listed:
    """Modes of a response to a force (at one place with it), or to the acceleration of the base.

    An acceleration is absolute, a displacement or velocity relative to the base. The contact is taken to slide where
    the response was measured.
    """
    estimate, step, drive, response = estimated(values, segment, window)
    force, motion = values[drive], values[response]
    if drive == "base_acceleration" and response == "acceleration":
        motion = motion - force
    relative = h1(step, force, motion, estimate.segment, estimate.window)
    found = driven_modes(step, force, motion, response, relative, band)
    rows, mass, notes = _of_force(found) if drive == "force" else _of_base(found)
    if force.size > SAMPLES:
        notes.append(
            f"the modes are fitted to the first {SAMPLES} of {force.size} samples, a duration of "
            f"{SAMPLES * step:.4g} s"
        )
    return Listed(
        found.frequency,
        found.damping,
        rows,
        mass,
        _told(found),
        _noted(found, estimate, step) + notes,
        estimate,
    )


def _of_force(found: Modes) -> tuple:
    if found.residue[0] <= 0:
        raise PatchfemError(
            f"the mode at {found.frequency[0]:.5g} Hz moves against the force: force and response are "
            "not at the same point, or one of the two has the wrong sign, so the modal mass is unknown"
        )
    size = np.sqrt(np.abs(found.residue) / found.residue[0])
    turned = found.residue < 0
    notes = [
        f"the mode at {f:.5g} Hz moves against the force, which is impossible if force and response are at the "
        "same point; the sign of this mode is ignored"
        for f in found.frequency[turned]
    ]
    return {"slide": size, "output": size}, 1 / float(found.residue[0]), notes


def _of_base(found: Modes) -> tuple:
    taken = -found.residue  # participation times output
    size = np.sqrt(np.abs(taken))
    scale = max(1.0, float(np.sqrt(np.sum(size**2))))
    out = np.sign(taken) * size * scale
    return (
        {"slide": out, "output": out, "base": size / scale},
        None,
        ["a response to base motion gives no modal mass: set moving_mass"],
    )


def _told(found: Modes) -> list:
    out = []
    for k, (zeta, error) in enumerate(zip(found.damping, found.error)):
        read = (
            ""
            if not found.read[k] > 0
            else f"; the estimate from windowed segments gives {found.read[k]:.4g}"
        )
        seen = "" if found.coherence is None else f"; coherence {found.coherence[k]:.3g}"
        out.append(f"damping {zeta:.4g} +- {error:.1g} from the whole record{read}{seen}")
    return out


def _noted(found: Modes, estimate: Estimate, step: float) -> list:
    """Sentences on what the window adds and on what the modes leave over."""
    notes = []
    wide = found.read > (1 + WIDER) * found.damping
    # one whole record is cut nowhere: what it reads more is noise
    if wide.any() and estimate.segments > 1:
        k = int(np.argmax(np.where(wide, found.read / found.damping, 0)))
        notes.append(
            f"segments of {estimate.segment * step:.3g} s (window {estimate.window}) widen the peak at "
            f"{found.frequency[k]:.5g} Hz: the segments give the damping {found.read[k]:.4g}, but the whole "
            f"record gives {found.damping[k]:.4g}, and the value from the whole record is written; a free "
            "decay (--decay) gives the damping without an input"
        )
    if found.misfit > LOOSE:
        notes.append(
            f"the modes leave {100 * found.misfit:.0f} % of the response (root mean square) unexplained: the "
            "record is noisy, or the rig is not linear"
        )
    return notes


def _freely(values: dict, begin: float | None) -> tuple:
    """(times, values, name) of the one response from `begin` [s] on, unless given from its largest value."""
    name = response_of(values)
    if "time" not in values:
        raise PatchfemError("a free decay needs a time channel; choose this channel with --map")
    time, value = values["time"], values[name]
    start = (
        int(np.argmax(np.abs(value - value[-value.size // 20 :].mean())))
        if begin is None
        else int(np.searchsorted(time, begin))
    )
    return time[start:], value[start:], name


def decay_curve(values: dict, begin: float | None = None) -> tuple:
    """(DecayCurve, notes) over the amplitude [m] of a free decay of a displacement, velocity or acceleration from
    `begin` [s] on, unless given from its largest value.

    A velocity is divided by the undamped omega of its own point, an acceleration by its square. An amplitude whose
    damping ratio has an interval wider than WIDE times its value is left out, as the notes say. PatchfemError where no
    decay stands out of the noise.
    """
    time, value, name = _freely(values, begin)
    swings = half_swings(time, value)
    found, notes = curve_of(swings), []
    known = found.damping_error <= WIDE * np.abs(found.damping)
    if found.time.size and not known.all():
        told = f"{np.count_nonzero(~known)} of {known.size} amplitudes"
        if not known.any():
            raise PatchfemError(
                f"the damping ratio has an interval wider than {WIDE:g} times its value at all "
                f"{known.size} amplitudes: the record has too few half cycles or too much noise"
            )
        found, notes = (
            found.at(known),
            [
                f"{told} are left out: the interval of the damping ratio is wider than "
                f"{WIDE:g} times its value there"
            ],
        )
    if ended := sparse_after(time, swings):
        notes.append(f"the decay is followed up to {swings.middle[-1]:.4g} s only: {ended}")
    omega = 2 * np.pi * found.frequency / np.sqrt(1 - found.damping**2)
    return found._replace(amplitude=found.amplitude / omega ** POWER[name]), notes


def of_decay(values: dict, begin: float | None = None) -> Listed:
    """Modes of a free decay from `begin` [s] of its times on, unless given from its largest value."""
    found = decay(*_freely(values, begin)[:2])
    about = [
        f"damping {zeta:.4g} +- {error:.1g}, logarithmic decrement {fall:.4g}"
        for zeta, error, fall in zip(found.damping, found.error, found.decrement())
    ]
    notes = [
        "a free decay gives neither the modal mass nor the mode shapes: set moving_mass, slide, base and output"
    ]
    if found.misfit > LOOSE_DECAY:
        notes.append(
            f"the decay leaves {100 * found.misfit:.0f} % of the record unexplained: the decay is noisy or "
            "not exponential, as with friction damping; the damping given is a mean over the record"
        )
    size = np.where(np.arange(found.frequency.size) == np.argmax(found.amplitude), 1.0, 0.0)
    return Listed(
        found.frequency, found.damping, {"slide": size, "output": size}, None, about, notes
    )


def of_shapes(shapes: Shapes, places: dict) -> Listed:
    """Modes of measured shapes; places: what of PLACES -> "12:+x", `slide` at least unless there is one place only.

    The mass is that which the modes hold at the place that slides (or `base`), 1 / sum phi^2: no less is possible.
    """
    if "slide" not in places:
        if len(shapes.motion) != 1:
            first = next(iter(shapes.motion))
            raise PatchfemError(
                f"the file has {len(shapes.motion)} nodes and directions; give the node and direction "
                f"that slide, such as --map slide={first[0]}:+{structure_places.AXES[first[1]]}"
            )
        node, axis = next(iter(shapes.motion))
        places = {"slide": f"{node}:+{structure_places.AXES[axis]}", **places}
    motion = {key: shapes.motion_at(text, key) for key, text in places.items()}
    held = float(np.sum(motion.get("base", motion["slide"]) ** 2))
    if not held > 0:
        raise PatchfemError("no mode moves the node that slides")
    order = np.argsort(shapes.frequency, kind="stable")
    rows = {key: row[order] / np.sqrt(held) for key, row in motion.items()}
    rows.setdefault("output", rows["slide"])
    rows.setdefault("base", rows["slide"])
    mass = (
        f"moving_mass is set to {1 / held:.5g} kg, the mass that these modes contain at the node that slides; with "
        "a larger value, part of the mass would belong to no mode"
    )
    return Listed(
        shapes.frequency[order],
        shapes.zeta[order],
        rows,
        1 / held,
        [""] * order.size,
        [*shapes.notes, mass],
    )
