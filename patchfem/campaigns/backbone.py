"""Backbone of a mode with its joint: frequency and damping over the amplitude, in three ways beside each other.

"balance": the periodic motion that a negative damping keeps up, by harmonic balance, under rigid friction exactly from
turn to turn (extended periodic motion: Krack 2015). "decay": a release from the largest amplitude, read from turn to
turn. "quasi-static": one static force along the shape of the held mode and the loops of the laws. The first is what a
slow decay shows; the second has what a swing loses within a cycle, too; the third leaves out how the force bends the
motion.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from ..core import NotConverged, PatchfemError, Start, say
from ..dynamics import limit_cycles
from ..dynamics.events.elements import JOINED, cells_joined
from ..dynamics.harmonic import quasi_static
from ..dynamics.harmonic.backbone import FreeBalance
from ..dynamics.harmonic.forces import Group
from ..dynamics.harmonic.harmonic import pack as harmonics_packed
from ..dynamics.harmonic.laws import synthesis
from ..dynamics.harmonic.point import balance_of, top
from ..effects import NO_WAVEFORM, has, unbuilt
from ..friction.record import loop_from
from ..model.model import Model
from ..model.slide import SlidePath
from ..model.source import placed
from ..response.decay_curve import DecayCurve, curve_of, of_turns, turns, turns_from_outside
from ..response.errors import error_of_change, finer_errors, with_errors
from ..runs.bench import bench
from ..runs.bench.engine import steps_of
from ..runs.bench.errors import errors_of
from ..runs.joint import held_patch
from ..runs.patch import faces
from ..runs.patch import result as patch_result
from ..runs.plan import plan
from ..runs.rig import decays, numerics
from ..runs.rig.engines import ENGINES, PIECES, SMOOTH
from ..runs.rig.plan import held_by
from ..structure import drives
from ..structure.drive_sizes import decay_rate

WAYS = ("balance", "decay", "quasi-static")
LADDER = (9, 19, 39)  # harmonics that are tried, each time with four times the samples of a cycle
MOST = 65536  # samples of a cycle
DECADE = 8  # amplitudes a decade, unless given
LOW, HIGH = 1e-2, 15.0  # their ends over the slide at which all of the contact slips
MICRO, GROSS = 0.3, 3.0  # shares of that slide, below which the contact is in micro-slip, above which all of it slips
SOFT, HARD = 0.7, 3.0  # of the amplitude at which a cubic spring has the mode's stiffness, the largest by default
FREE = 2.0  # the first of rigid friction, over what friction deflects the mode by at rest
RESOLVED = 4.0  # times its error, a loss that counts for an exponent
FEW = 6  # amplitudes that are named one by one
SMALL = 1e-5  # of the slide at which all of the contact slips, one in which nothing slips
LOOPS, MOST_LOOPS = 3.0, 192.0  # cycles of a first loop on a bench, of which the last is read, and the most
LOOP = ("secant_stiffness", "loop_area")
ROUND = 1e-9  # of a value, what round-off leaves
SAMPLES = 4096  # of a cycle of a static loop, and that a largest motion is read from
SLIDES = 60  # tries of the slides whose static motion has the amplitudes that are asked for
CLOSE = 1e-7  # of an amplitude, within which a free motion is at it
PLAIN, BALANCED = (1e-6, 1e-3, 4), 8  # amplitudes [m] of a linear rig; steps to the damping that keeps it swinging
BEATS = 8  # half swings on both sides of one, among which what other modes change is largest
EQUAL = 1e-7  # of a half swing, by which two that follow each other differ where nothing slips
SIZED, SLOW = 8, 0.1  # steps to a motion that has the amplitude asked for; least slope of both amplitudes that is taken
SHORT, LONGEST = 50, (12800, 3200)  # cycles of a first decay; of the longest, of one mode and where several ring
TURNED = 102400  # of the longest of one mode behind elements, of which the turns alone are kept
STARTS = 12  # amplitudes on the way to the free motion that a release begins in
BESIDE = 1.15  # the release over the largest amplitude: the first swings still show how it began
HIGHER, BELOW = 3, 0.8  # releases from higher up; share of the smallest amplitude down to which coarser runs come, too
FARTHEST, SWINGS = 8.0, 3.0  # of a start, a higher one at most; free swings within which a decay shows itself
FINER = 3  # doublings of the steps of a decay
FLUTTER_TOL = 1e-8  # relative error of the amplitude at which the damping is zero, below the digits that are printed
RINGS, HEARD = 0.1, 1e-3  # of a decay's amplitude, motion of other modes from which it is no more its own, is told
HOLDS = 0.999  # of its stiffness without slip, that of a contact in whose motion no modes are coupled by slip
TOLD, WITH_COARSER = 20.0, 2.0  # seconds, from which a decay is told beforehand; times its own, with its coarser runs


UNKNOWN = ('the friction loop of bonds has a closed form only with reading = "stretch", order = 1, a constant bond '
           'length, breakaway = 0 and pieces that are rigid in shear')


class Curve(NamedTuple):
    """One way: amplitude (k,) [m] at the output, frequency (k,) [Hz] and damping ratio (k,) [1] with their errors, loss
    of the contact per cycle (k,) [J], NaN where it is not known; notes: sentences on its errors; others: of a decay,
    the motion of other modes over its amplitude (k,), NaN where it is not known."""

    amplitude: np.ndarray
    frequency: np.ndarray
    frequency_error: np.ndarray
    damping: np.ndarray
    damping_error: np.ndarray
    loss: np.ndarray
    notes: tuple = ()
    others: np.ndarray | None = None

    def at(self, pick) -> "Curve":
        """Some of its points: bools (k,)."""
        return Curve(*(part[pick] for part in self[:6]), self.notes, None if self.others is None else self.others[pick])


class Backbone(NamedTuple):
    """Curves of a mode by the way they were found; missing: way -> why it is none; free, stuck [Hz]: of the mode
    without the contact and with it held, None where it does not move then; micro, gross: exponents of the contact's
    loss over the amplitude at both ends, None where it loses nothing, expected: the first by theory, None where none
    tells; stuck_error [Hz]: of `stuck`, None of what is known; flutter [m]: the amplitude beyond which the mode
    gains energy, None without; notes: sentences."""

    mode: str
    free: float
    stuck: float | None
    curves: dict
    missing: dict
    micro: float | None
    gross: float | None
    flutter: float | None
    notes: tuple
    expected: float | None = None
    stuck_error: float | None = None


class Joint(NamedTuple):
    """The rig of a backbone: its Model, pressed Patch or None, coarser Patch or None, number of the mode's coordinate,
    held: (omega [rad/s], shape (n,)) of the mode with the contact held by `stiffness` (i,) [N/m], omega None where
    nothing gives way. apart: all coarser Patches or Nones; errors: whether those of the mesh and of the cells of a law
    are asked for."""

    model: Model
    patch: object
    coarse: object
    mode: int
    held: tuple
    stiffness: np.ndarray
    apart: tuple = (None,)
    errors: bool = True

    @property
    def reach(self) -> float:
        """Motion at the output per unit of the held shape."""
        return abs(float(self.model.rig.modes.output @ self.held[1]))

    @property
    def face(self) -> int:
        """Number of the interface whose force on the held mode rises most."""
        slides = np.abs(self.modes.interfaces @ self.held[1])
        return int(np.argmax(slides * np.where(np.isfinite(self.stiffness) & (self.stiffness > 0), self.stiffness, 1)))

    @property
    def modes(self):
        """The ModalBasis of the rig."""
        return self.model.rig.modes

    @property
    def linear(self) -> bool:
        """Whether neither friction acts nor a spring bends."""
        others = sum(one.numbers.static * (one.load or 0.0) for one in self.model.rig.interfaces) \
            if len(self.model.rig.interfaces) > 1 else 0.0
        return not (_limit(self) or others or self.model.rig.bends)


def backbone(model: Model, mode: str = "", amplitudes=None, methods=WAYS, progress=None,
             errors: bool = True) -> Backbone:
    """Curves of a rig's mode, of its first where none is named.

    amplitudes (k,) [m] at the output, rising; None: from a hundredth of the slide at which all of the contact slips to
    15 times it, or to where the mode slides as if it were free. progress: called with a way that begins, and with what
    a decay will take where that is more than TOLD. errors: without them those of the mesh, of the cells of a law and of
    modes left out are not computed, and the values are the same in less than half the time. Where no friction acts and
    no spring bends the curves are level.
    PatchfemError for a scene that has no rig or no such mode.
    """
    with placed(model.source):
        joint = _joint(model, mode)._replace(errors=errors)
        wanted = _default(joint) if amplitudes is None else np.unique(np.asarray(amplitudes, float))
        if wanted[-1] > joint.model.rig.travel:
            raise PatchfemError(f"the largest amplitude, {say(wanted[-1], 3)}, is larger than the travel of the "
                                "flexure; give smaller amplitudes with --amplitudes", "structure.travel")
        curves, missing, richer = {}, {}, model.rig.richer if errors else None
        other = None if richer is None else _joint(replace(model, rig=richer), mode)
        for way in methods:
            if progress is not None:
                progress(way)
            try:
                curve = _curve(joint, wanted, way, progress)
                curves[way] = curve if other is None else _beside(curve, _curve(other, wanted, way, progress))
            except (NotConverged, PatchfemError) as reason:
                missing[way] = str(reason).removeprefix("backbone: ")
    return _put_together(joint, wanted, curves, missing)


def _curve(joint: Joint, amplitudes, way: str, progress=None) -> Curve:
    if joint.linear:
        return _level(joint, amplitudes, way)
    return _decayed(joint, amplitudes, progress) if way == "decay" else FIND[way](joint, amplitudes)


def _beside(curve: Curve, other: Curve) -> Curve:
    """The curve of a reduced structure with the error of the modes left out, from the curve of more of them, where both
    have amplitudes."""
    a, ends = curve.amplitude, other.amplitude[[0, -1]] * [1 - CLOSE, 1 + CLOSE]
    curve = curve.at((a >= ends[0]) & (a <= ends[1]))
    if not curve.amplitude.size:
        raise NotConverged("the check by a computation with more modes of the structure found no free motion at these "
                           "amplitudes; raise structure.reduced.modes")
    values = finer_errors(_at(curve.amplitude, curve), _at(curve.amplitude, other))
    return curve._replace(frequency_error=curve.frequency_error + values["frequency"],
                          damping_error=curve.damping_error + values["damping"])


def _at(amplitudes, curve: Curve) -> dict:
    """Frequencies [Hz] and damping ratios by name of a curve at amplitudes (k,) [m]."""
    return {name: np.interp(amplitudes, curve.amplitude, getattr(curve, name)) for name in ("frequency", "damping")}


def _joint(model: Model, name: str) -> Joint:
    if model.rig is None:
        raise PatchfemError("a backbone needs the scene of a rig; add the tables [structure] and [drive]", "structure")
    modes, number = model.rig.modes, _number(model.rig, name)
    if modes.lateral_faces is not None:
        flat = next(one.key for one in model.rig.interfaces if one.lateral)
        raise PatchfemError(unbuilt("a backbone with interfaces that slide in a plane", "out"), f"{flat}.lateral")
    patch, apart = None, (None,)
    if model.patch is not None:
        patch, *apart = *patch_result.solve_all(model.patch, model.accuracy.tolerance), None
    alone = (None, np.eye(modes.omega.size)[number])
    joint = Joint(model, patch, apart[0], number, alone, np.zeros(len(modes.interfaces)), tuple(apart))
    if not joint.linear:
        stiffness = _held_by(joint._replace(stiffness=held_by(model.rig, plan(model).chain)))
        joint = joint._replace(held=modes.held(modes.interfaces, stiffness, number), stiffness=stiffness)
    if not _limit(joint) and model.rig.bends and (model.friction is not None or model.rig.interfaces):
        raise PatchfemError("the load or the coefficient of friction is 0, so no friction acts; for the backbone "
                            "without friction leave out [friction] and the normal load", "friction.static")
    if not (modes.omega[number] or joint.held[0]):
        raise PatchfemError("this mode has 0 Hz and rigid friction acts on it, so the mode has no natural frequency")
    if not (joint.linear or model.rig.bends or np.abs(modes.interfaces @ joint.held[1]).max() > 0):
        raise PatchfemError("the mode does not move the contact, so no friction acts on the mode; choose another mode "
                            "with --mode, or give this mode the key `slide`")
    if not joint.reach > 0:
        raise PatchfemError("the mode does not move the point of the output, so its amplitude there is 0; give the "
                            "mode the key `output`, or choose another mode with --mode")
    return joint


def _level(joint: Joint, amplitudes, way: str) -> Curve:
    """Of a linear rig: by balance and by a static force omega and zeta of the damping -g of every coordinate that
    keeps a motion up, zeta = g/(2 omega); of a decay its own frequency omega (1 - zeta^2)^(1/2)."""
    modes, n = joint.modes, joint.modes.omega.size

    def root(g: float) -> complex:
        """Of z'' + (D - g) z' + Omega^2 z = 0, that in which the coordinate moves most."""
        values, vectors = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)],
                                                  [-np.diag(modes.omega**2), g * np.eye(n) - modes.dampers]]))
        return values[np.argmax(np.abs(vectors[joint.mode]) / np.linalg.norm(vectors[:n], axis=0))]

    g = 0.0
    for _ in range(BALANCED):
        g -= 2 * root(g).real
    kept, own = abs(root(g)), root(0.0)
    if not (own.imag and g < 2 * kept):
        raise NotConverged("the mode does not oscillate: its damping ratio is 1 or more")
    omega, zeta = (abs(own.imag), -own.real / abs(own)) if way == "decay" else (kept, g / (2 * kept))
    f, zeta = np.full(amplitudes.size, omega / (2 * np.pi)), np.full(amplitudes.size, zeta)
    return Curve(amplitudes, f, ROUND * f, zeta, ROUND * np.abs(zeta), np.full(f.size, np.nan))


def _number(rig, name: str) -> int:
    """Number of the coordinate of a mode by its name, or of a rig of masses by its number from 1; of the first mode of
    the scene unless given."""
    modes, names = rig.modes, list(rig.modes.names)
    if not rig.by_modes:
        if name and not (name.isdecimal() and 1 <= int(name) <= modes.omega.size):
            raise PatchfemError(f"backbone --mode {name}: the rig has {modes.omega.size} mode"
                                f"{'s' * (modes.omega.size != 1)}, counted from 1", "")
        return int(name) - 1 if name else int(np.argmax(modes.omega > 0))
    if name and name not in names:
        raise PatchfemError(f"backbone --mode {name}: no mode has this name; the modes of the rig are "
                            f"{', '.join(names)}", "")
    k = names.index(name) if name else 0
    return k if modes.shapes is None else int(np.argmax(np.abs(modes.shapes[k])))


def _held_by(joint: Joint) -> np.ndarray:
    """Tangential stiffness (i,) [N/m] of each interface when nothing slips: of the laws' loops where they have one in
    closed form, of a small loop on a bench where there is one interface, else of the plan's chain."""
    model, chain = joint.model, joint.stiffness
    if _rigid(model) or model.friction is None or model.grooves is not None or model.rig.load_varies \
            or model.rig.strips_slide_apart or not np.isfinite(chain).all() or not chain.all():
        return chain
    try:
        return _group(joint, joint.patch).stiffness()[:chain.size]
    except PatchfemError:
        if chain.size > 1:
            return chain
        small = SMALL * _limit(joint) / chain[0]
        return np.array([_settled(joint, small, model.rig.own_frequency)[0].values["secant_stiffness"]])


def _limit(joint: Joint) -> float:
    """Largest friction [N] of the interface that counts; 0 without friction."""
    model = joint.model
    if len(model.rig.interfaces) > 1 and joint.patch is None:
        one = model.rig.interfaces[joint.face]
        return one.numbers.static * one.load
    if model.friction is None:
        return 0.0
    return model.friction.static * (joint.patch.pressure.load if joint.patch is not None else model.nominal_load)


def _default(joint: Joint) -> np.ndarray:
    """Amplitudes (k,) [m] at the output, from where the contact holds to where the mode slides as if it were free."""
    if joint.linear:
        return np.geomspace(*PLAIN) * min(1.0, joint.model.rig.travel / PLAIN[1])
    low, high = _amplitude_of(joint, np.array(_ends(joint)))
    high = min(high, _bound(joint))
    low = min(low, LOW * high)
    return np.geomspace(low, high, 1 + int(np.ceil(DECADE * np.log10(high / low))))


def _bound(joint: Joint) -> float:
    """Amplitude [m] at the output below the stop, and where a cubic spring is soft or a few times as stiff as the mode:
    a soft one turns the block back no more from (k/|c|)^(1/2)."""
    rig, modes = joint.model.rig, joint.modes
    if not rig.cubic:
        return rig.travel / BESIDE
    own = np.sqrt(_spring(joint) / abs(rig.cubic)) / (abs(float(modes.output[joint.mode])) or joint.reach)
    return min(rig.travel / BESIDE, own * (SOFT if rig.cubic < 0 else HARD))


def _amplitude_of(joint: Joint, slide):
    """Amplitude [m] at the output of the held mode whose interface slides by `slide` [m]."""
    return joint.reach / (abs(float(joint.modes.interfaces[joint.face] @ joint.held[1])) or 1.0) * slide


def _knee(joint: Joint) -> float:
    """Slide [m] at which all of the contact slips, of rigid friction the way by which friction deflects the mode; of
    springs alone that at which they bend."""
    rig, stiffness = joint.model.rig, float(joint.stiffness[joint.face])
    if not _limit(joint):  # it doubles the mode's stiffness, or has a wave behind it
        return float(np.sqrt(_spring(joint) / abs(rig.cubic))) if rig.cubic is not None else rig.interlock[1]
    return _limit(joint) / stiffness if stiffness else _deflected(joint)


def _spring(joint: Joint) -> float:
    """Stiffness [N/m] of the mode without the contact, per unit of its coordinate."""
    return joint.modes.mass * float(joint.modes.omega[joint.mode] or joint.held[0])**2


def _deflected(joint: Joint) -> float:
    """Slide [m] by which the largest friction deflects the mode without the contact."""
    return _limit(joint) * float(joint.modes.interfaces[joint.face] @ joint.held[1])**2 / _spring(joint)


def _ends(joint: Joint) -> tuple:
    """Smallest and largest slide [m] of the default amplitudes."""
    knee, stiffness = _knee(joint), float(joint.stiffness[joint.face])
    free = _deflected(joint) if _limit(joint) else 0.0
    if 0 < stiffness < np.inf or not free:
        return LOW * knee, HIGH * max(knee, free)
    return FREE * free, HIGH * HIGH * free


def _balanced(joint: Joint, amplitudes) -> Curve:
    """Curve by harmonic balance, under rigid friction from turn to turn."""
    _refuse(joint, "balance")
    model = joint.model
    if _rigid(model):
        return _turned(joint, amplitudes)
    group = _group(joint, joint.patch)
    found, error = _free(group, joint, amplitudes, LADDER[0]), None
    for harmonics in LADDER[1:]:
        count = 1 + int(np.isfinite(found[0]).nonzero()[0].max(initial=-1))
        if not count:
            raise NotConverged("no free motion of these amplitudes was found")
        better = _free(group, joint, amplitudes, harmonics, count)
        error, found = error_of_change(better - found) + ROUND * np.abs(better), better
        known = np.isfinite(error[0])
        if (error[:2] <= model.accuracy.tolerance * np.abs(found[:2]))[:, known].all():
            break
    error += _in_space(joint, lambda laws: _free(laws, joint, amplitudes, LADDER[0]))
    known = np.isfinite(found + error).all(axis=0)
    if not known.any():
        raise NotConverged("no free motion of these amplitudes was found")
    swings = known & (found[1] < 1)  # a motion that loses more in a cycle does not swing
    if not swings.any():
        raise NotConverged("the mode does not oscillate at these amplitudes: its damping ratio is above 1")
    return Curve(amplitudes, found[0], error[0], found[1], error[1], found[2]).at(swings)


def _refuse(joint: Joint, way: str) -> None:
    """PatchfemError where a steady loop does not tell the free motion."""
    model = joint.model
    for reason, holds in (("on grooves", model.grooves is not None),
                          ("with a load that changes with the motion", model.rig.load_varies),
                          ("for strips that slide independently of one another", model.rig.strips_slide_apart),
                          ("for several interfaces with rigid friction",
                           _rigid(model) and len(model.rig.interfaces) > 1)):
        if holds:
            raise PatchfemError(f"{way} cannot be computed {reason}")


def _rigid(model: Model) -> bool:
    """Whether friction holds without any stretch."""
    return not model.soft and any(has(one.numbers.law, "set-valued") and not one.soft for one in model.rig.interfaces)


def _group(joint: Joint, patch, meshed: tuple = ()) -> Group:
    """`decays.laws_on` of the rig; PatchfemError where a law has no steady loop of its own."""
    try:
        return decays.laws_on(joint.model, patch, meshed)
    except PatchfemError:
        benched = not joint.model.rig.bends and len(joint.model.rig.interfaces) < 2
        raise PatchfemError(UNKNOWN + "; use --method quasi-static" * benched) from None


def _in_space(joint: Joint, read) -> np.ndarray:
    """Return the errors of what read(Group) gives by coarser meshes and by fewer cells of a density of sliders."""
    model, error = joint.model, 0.0
    celled = any(has(one.numbers.law, "cells") for one in model.rig.interfaces)
    soft = model.soft or model.rig.soft
    if not joint.errors or not (celled or soft):
        return error
    fine = _group(joint, joint.patch)
    best = read(fine)
    if soft:
        error = error + decays.mesh_error(fine, decays.rough_laws(model, joint.coarse), read)
    if celled:
        apart = [np.abs(read(fine.remade(partial(cells_joined, *one))) - best) for one in JOINED]
        error = error + error_of_change(np.max(apart, axis=0), ratio=4.0, order=2.0)
    return error


def _free(group: Group, joint: Joint, amplitudes, harmonics: int, count=None) -> np.ndarray:
    """(frequency [Hz], damping, loss [J]) (3, k) of the free motions at amplitudes (k,) [m] of the output, NaN where
    none is found, and from the number `count` on."""
    k, out = np.arange(harmonics + 1), np.full((3, len(amplitudes)), np.nan)
    for column, one in enumerate(_motions(group, joint, amplitudes[:count], harmonics)):
        if one is None:
            continue
        loss = np.pi * float(np.sum(k * (np.conj(one.slides) * one.forces).imag))
        out[:, column] = one.omega / (2 * np.pi), one.zeta, loss
    return out


def _motions(group: Group, joint: Joint, amplitudes, harmonics: int) -> list:
    """The `harmonic.backbone.Free` motions at amplitudes (k,) [m] of the output, None where none is found. Each is
    sought from the one before; without one, as beyond a fold of the curve, beside the held mode, the first also on the
    way from where the contact holds; then from the next larger one that was found."""
    modes = joint.modes
    omega, shape = modes.held(group.rows, group.stiffness(), joint.mode)
    reach = abs(float(modes.output @ shape))
    widest = np.abs(group.rows @ shape) * amplitudes[-1] / reach
    samples = (group.samples or group.samples_for(harmonics, widest)) * (harmonics // LADDER[0])**2
    equations = FreeBalance(balance_of(modes, group, min(samples, MOST)), joint.mode, harmonics, omega)
    balance = equations.balance
    y = np.zeros((balance.lift.shape[1], harmonics + 1), complex)
    y[:, 1] = balance.faces @ shape
    first, small = np.append(harmonics_packed(y), [1.0, 0.0]), LOW * float(_amplitude_of(joint, _knee(joint))) / reach

    def at(amplitude: float, beside, begin: bool) -> tuple | None:
        """(Free, unknowns (N,), reach) from those of another amplitude, else from the held mode; None where there is
        none."""
        for near in [beside] * (beside is not None) + [None] * begin:
            here = amplitude / (near[2] if near else reach)
            try:
                x = equations.towards(near[1], near[0].amplitude, here) if near else \
                    equations.solve(first, here)[0] if any(out) else _begun(equations, first, small, here)
                return _sized(equations, joint, x, here, amplitude)
            except NotConverged:
                pass
        return None

    out, last = [None] * len(amplitudes), len(amplitudes) - 1
    for k, amplitude in enumerate(amplitudes):
        out[k] = at(amplitude, out[k - 1] if k else None, True)
    for k in range(last - 1, -1, -1):
        out[k] = out[k] or at(amplitudes[k], out[k + 1], False)
    return [one and one[0] for one in out]


def _sized(equations: FreeBalance, joint: Joint, x, here: float, amplitude: float) -> tuple:
    """(Free, unknowns (N,), reach) of the motion that is as large at the output as `amplitude` [m], from x at an
    amplitude `here` [m] of the coordinate: to ROUND, where the steps lead no further to CLOSE."""
    slope, before, near = 1.0, None, None
    for _ in range(SIZED):
        try:
            x, free = equations.solve(x, here)
        except NotConverged:
            if near is None:
                raise
            break
        off = float(np.log(_largest(free.modal @ joint.modes.output) / amplitude))
        if near is not None and abs(off) >= near[0]:
            break
        if abs(off) < CLOSE:
            near = abs(off), (free, x, amplitude / here)
        if abs(off) < ROUND:
            break
        if before is not None:
            slope = (off - before[1]) / np.log(here / before[0])
        slope, before = slope if slope > SLOW else 1.0, (here, off)
        here *= np.exp(-off / slope)
    if near is not None:
        return near[1]
    raise NotConverged(f"no free motion has an amplitude of {say(amplitude, 3)} at the output")


def _begun(equations: FreeBalance, first, small: float, here: float) -> np.ndarray:
    """Unknowns (N,) at an amplitude `here` [m] from those of the held mode, at once or by way of a small one."""
    try:
        return equations.solve(first, here)[0]
    except NotConverged:
        if not small < here:
            raise
        return equations.towards(equations.solve(first, small)[0], small, here)


def _largest(harmonics) -> float:
    """(max - min)/2 of a motion with harmonics (H + 1,)."""
    motion = synthesis(harmonics, SAMPLES)
    return (top(motion) + top(-motion)) / 2


def _turned(joint: Joint, amplitudes) -> Curve:
    """Curve under rigid friction; it begins where the motion no longer holds on the way."""
    model, modes, load = joint.model, joint.model.rig.modes, _limit(joint)
    if model.rig.bends or not modes.omega.all():
        raise PatchfemError("with rigid friction the free motion cannot be computed if the rig has a nonlinear spring "
                            "or a mode of 0 Hz")
    f, row = model.friction, modes.interfaces[0]
    kinetic = load if f.kinetic is None else load * f.kinetic / f.static
    found = limit_cycles.relay_backbone(modes, row, (kinetic, load), amplitudes, joint.mode)
    kept = [(a, *one) for a, one in zip(amplitudes, found) if one is not None]
    if not kept:
        raise NotConverged("at these amplitudes rigid friction stops the motion in each cycle, and only a motion that "
                           "always slides can be computed; give larger amplitudes")
    a = np.array([one[0] for one in kept])
    frequency, damping = np.array([(c.omega / (2 * np.pi), zeta) for _, c, zeta in kept]).T
    loss = 4 * kinetic * a * abs(row[joint.mode] / modes.output[joint.mode]) if modes.omega.size == 1 else \
        np.full(a.size, np.nan)
    relative_error = np.array([c.error / c.amplitude for _, c, _ in kept])
    # the damping of the structure does not depend on the amplitude, so only that of friction takes its error
    own_rate = modes.dampers[joint.mode, joint.mode]
    friction_damping = damping - own_rate / (4 * np.pi * frequency)
    damping_error = relative_error * np.abs(friction_damping) + ROUND * np.abs(damping)
    return Curve(a, frequency, (relative_error + ROUND) * frequency, damping, damping_error, loss)


def _static(joint: Joint, amplitudes) -> Curve:
    """Curve by one static force along the shape of the held mode; where the laws have no loop in closed form, by loops
    of the contact alone on a bench."""
    _refuse(joint, "static curve")
    if _rigid(joint.model):
        raise PatchfemError("rigid friction has no finite stiffness, so a static curve cannot be computed for the mode "
                            "of the sticking contact")
    if (known := _in_closed_form(joint, amplitudes)) is not None:
        return known
    try:
        group = _group(joint, joint.patch)
    except PatchfemError:
        if len(joint.model.rig.interfaces) > 1 or joint.model.rig.bends:
            raise
        return _on_a_bench(joint, amplitudes)

    def read(laws, samples: int) -> np.ndarray:
        return decays.static_rows(joint.modes, laws, joint.mode, amplitudes, samples)

    best = read(group, SAMPLES)
    best[0] = np.where(np.abs(best[0] / amplitudes - 1) < CLOSE, amplitudes, best[0])
    error = np.abs(best - read(group, SAMPLES // 2)) + ROUND * np.abs(best)
    error += _in_space(joint, lambda laws: read(laws, SAMPLES))
    return _rising(best, error)


def _rising(best, error) -> Curve:
    """The Curve of (amplitude, frequency, damping, loss) (4, k) and their errors, as far as its force rises with the
    amplitude: beyond that nothing stands still."""
    force = best[1]**2 * best[0]
    whole = np.isfinite(best + error).all(axis=0) & (np.diff(force, prepend=0.0) > 0)
    count = whole.size if whole.all() else int(np.argmin(whole))
    if not count:
        raise NotConverged("no static force with the shape of the mode holds the rig in equilibrium at these "
                           "amplitudes; use --method balance")
    return Curve(best[0], best[1], error[1], best[2], error[2], best[3]).at(slice(count))


def _in_closed_form(joint: Joint, amplitudes) -> Curve | None:
    """Static curve of one interface whose law knows its loop; None where there is more, or the loop is not known."""
    model, modes = joint.model, joint.modes
    if model.friction is None or model.soft or model.rig.soft or model.rig.bends or len(model.rig.interfaces) > 1:
        return None
    slides = np.abs(modes.interfaces[0] @ joint.held[1]) * amplitudes / joint.reach
    for _ in range(SLIDES):
        found = [loop_from(model.friction, _limit(joint) / model.friction.static, float(one)) for one in slides]
        if None in found:
            return None
        best = decays.rows_of(modes, quasi_static.through(modes, modes.interfaces[0], joint.held, slides,
                                                          [quasi_static.Loops(*one) for one in found]))
        if (np.abs(best[0] / amplitudes - 1) < CLOSE).all():
            break
        slides = slides * amplitudes / best[0]  # other shapes at the output than that of the held mode
    at = np.abs(best[0] / amplitudes - 1) < CLOSE
    best = np.where(at, best, np.nan)
    best[0] = amplitudes
    return _rising(best, (ROUND + CLOSE * (modes.omega.size > 1)) * np.abs(best))


def _on_a_bench(joint: Joint, amplitudes) -> Curve:
    """Static curve from loops of the contact on a bench, a few cycles at the mode's own frequency."""
    modes, row = joint.modes, joint.modes.interfaces[0]
    slides = np.abs(row @ joint.held[1]) * amplitudes / joint.reach
    found, errors = [], []
    for slide in slides:
        fine, alone, steps, change = _settled(joint, float(slide), joint.held[0] / (2 * np.pi))
        patches = [joint.patch] if joint.coarse is None else [joint.patch, joint.coarse]
        bars = with_errors(fine.values, *errors_of(alone, patches, fine, steps)[0], least=1e-10)
        tip, area = ((fine.values[name], bars[name].error + off) for name, off in zip(LOOP, change))
        found.append(quasi_static.Loops(tip[0] * slide, area[0]))
        errors.append(quasi_static.Loops(tip[1] * slide, area[1]))

    def read(loops) -> np.ndarray:
        return decays.rows_of(modes, quasi_static.through(modes, row, joint.held, slides, loops))

    best = read(found)
    error = ROUND * np.abs(best)
    for change in ((1, 0), (0, 1)):  # the tip, then the area, each by its error
        moved = [quasi_static.Loops(one.tip + change[0] * off.tip, one.area + change[1] * off.area)
                 for one, off in zip(found, errors)]
        error += np.abs(read(moved) - best)
    return _rising(best, error)


def _settled(joint: Joint, slide: float, frequency: float) -> tuple:
    """(BenchRun, its Model, its steps, what the later half of its cycles changed of LOOP) of a loop that has settled,
    or of the most cycles that are tried."""
    tolerance, cycles = joint.model.accuracy.tolerance, LOOPS
    found = _loop(joint, slide, frequency, cycles)
    while True:
        cycles *= 2
        before, found = found[0].values, _loop(joint, slide, frequency, cycles)
        values = found[0].values
        change = [abs(values[name] - before[name]) for name in LOOP]
        if cycles >= MOST_LOOPS or all(off <= tolerance * abs(values[name]) for name, off in zip(LOOP, change)):
            return *found, change


def _loop(joint: Joint, slide: float, frequency: float, cycles: float) -> tuple:
    """(BenchRun, its Model, its steps) of some cycles of the contact alone under a sine of amplitude `slide` [m]."""
    path = SlidePath("sine", slide, frequency, None, 0.0, cycles, None, None)
    alone = replace(decays.steadily(joint.model), kind="bench", rig=None, slide=path)
    steps = steps_of(alone)
    return bench.run(alone, joint.patch, steps), alone, steps


def _decayed(joint: Joint, amplitudes, progress=None) -> Curve:
    """Curve of a release from the largest amplitude, read from turn to turn, as far as it comes down."""
    n_decaying, (what, how, found) = _come_down_from_largest_decaying(joint, amplitudes, progress)
    engine, tolerance = ENGINES[how.engine], joint.model.accuracy.tolerance
    for tried in range(FINER + 1):
        best, reading, error = _with_errors(joint, what, how, found, amplitudes)
        known = np.isfinite(best + error).all(axis=0)
        small = (error <= np.maximum(tolerance * np.abs(best), reading)).all(axis=0)
        if (known.any() and small[known].all()) or tried == FINER or \
                not engine.in_time(what, how, joint.patch) or "steps_per_cycle" in how.pinned:
            break
        how = how.finer()
        found = engine.run(what, how, joint.patch, 0, None, None)
    if not known.any():
        raise NotConverged("the free decay gave no frequency and damping at these amplitudes")
    others = _others(joint, found, np.where(known, amplitudes, np.nan))
    rings = known & (others > 0) & (amplitudes <= amplitudes[others > RINGS].max(initial=0.0))
    known &= ~rings
    if not known.any():
        raise NotConverged("at these amplitudes the free decay is no longer a motion of this mode alone: the motion of "
                           f"other modes is more than {100 * RINGS:.0f} % of its amplitude")
    mesh, why = decays.left_by_mesh(joint.model, joint.patch, joint.coarse, amplitudes, lambda laws: joint.mode)
    error = np.fmax(error, mesh) + reading
    notes = decays.without_slip_between_nodes({"method decay": why}, lambda: engine.in_space(
        what, how, joint.patch, joint.coarse, found))
    if rings.any():
        notes = [*notes, f"method decay: when the decay has fallen to {say(amplitudes[rings][-1], 3)}, the motion of "
                         f"other modes is more than {100 * RINGS:.0f} % of its amplitude; from there on the values "
                         f"with slip are left out ({rings.sum()} amplitude{'s' * bool(rings.sum() > 1)}), because they "
                         "do not describe this mode alone"]
    if n_decaying < amplitudes.size:
        notes = [*notes, f"method decay: a release from {say(amplitudes[n_decaying], 3)} grows, because the negative "
                         "damping supplies more energy than friction dissipates"]
    unknown = known & np.isnan(others)
    if unknown.any() and joint.modes.omega.size > 1:
        lacks = "with rigid friction it is not computed" if _rigid(joint.model) else \
            "harmonic balance gave no free motion to compare with"
        notes = [*notes, f"method decay: how much other modes move in the decay is not known at {unknown.sum()} of "
                         f"{known.sum()} amplitudes, because {lacks}"]
    return Curve(amplitudes, best[0], error[0], best[1], error[1], np.full(amplitudes.size, np.nan),
                 tuple(notes), others).at(known)


def _others(joint: Joint, found, amplitudes) -> np.ndarray:
    """Motion of other modes in a Solution over its amplitude (k,) where it has the amplitudes (k,) [m]: the distance of
    its modal coordinates and of their rates over omega from those of the balance's free motion of that amplitude, both
    where they turn and over their motion along the held shape. 0 where all contacts hold: the motion along the held
    shape is then free of other modes, whatever rings (as long as no slide is larger than one in which the balance
    finds no slip). NaN where one of them is not known."""
    out, motion, shape = np.full(amplitudes.size, np.nan), found.response, joint.held[1]
    asked = np.flatnonzero(np.isfinite(amplitudes))
    if shape.size == 1 or _rigid(joint.model):
        return out
    try:
        _refuse(joint, "balance")
        group = _group(joint, joint.patch)
        free = _motions(group, joint, amplitudes[asked], LADDER[0])
    except (NotConverged, PatchfemError):
        return out
    held = np.max([np.where(_holds(group, one), np.abs(one.slides[:, 1]), 0.0) for one in free if one is not None] or
                  [np.zeros(len(group.rows))], axis=0)
    read, (times, _) = _read(joint, found), turns(motion.time, motion.modal @ shape, motion.modal_rate @ shape)
    for column, one in zip(asked, free):
        if one is None:
            continue
        time = times[np.argmin(np.abs(times - np.interp(-np.log(amplitudes[column]), -np.log(read.amplitude),
                                                        read.time)))]
        k = int(np.clip(np.searchsorted(motion.time, time), 1, motion.time.size - 1))
        two = slice(k - 1, k + 1)
        cubic = CubicHermiteSpline(motion.time[two], motion.modal[two], motion.modal_rate[two])
        place, rate = cubic(time), cubic(time, 1) / one.omega
        if (np.hypot(group.rows @ place, group.rows @ rate) <= held).all():
            out[column] = 0.0
            continue
        turn = 1j * np.arange(one.modal.shape[0])[:, None] * one.modal
        beside = [np.apply_along_axis(synthesis, 0, part, SAMPLES) for part in (one.modal, turn)]
        side = np.sign(place @ shape)
        top_of = int(np.argmax(side * (beside[0] @ shape)))
        own, other = abs(place @ shape), side * float(beside[0][top_of] @ shape)
        out[column] = np.hypot(*(np.linalg.norm(part / own - there[top_of] / other)
                                 for part, there in zip((place, rate), beside)))
    return out


def _holds(group: Group, one) -> np.ndarray:
    """Whether each interface (i,) has its stiffness without slip in a free motion, bools."""
    force, slide = one.forces[:, 1], one.slides[:, 1]
    return np.real(force * np.conj(slide)) >= HOLDS * group.stiffness() * np.abs(slide)**2


class _GrowingRelease(NotConverged):
    """A release whose swings grow, because a negative damping supplies more than friction dissipates."""


def _come_down_from_largest_decaying(joint: Joint, amplitudes, progress=None) -> tuple:
    """Run `_come_down` from the largest of the rising amplitudes (k,) [m] whose release does not grow.

    Returns the number of amplitudes up to that one, and what `_come_down` returns.
    """
    for count in range(amplitudes.size, 0, -1):
        try:
            return count, _come_down(joint, amplitudes[:count], progress)
        except _GrowingRelease:
            continue
    raise NotConverged(f"a release from {say(amplitudes[0], 3)} grows, because the negative damping supplies more "
                       "energy than friction dissipates; give smaller amplitudes with --amplitudes")


def _grows(joint: Joint, found) -> bool:
    """Whether the swings of a release in a Solution become larger along the held shape."""
    motion, shape = found.response, joint.held[1]
    _, places = turns(motion.time, motion.modal @ shape, motion.modal_rate @ shape)
    swings = np.abs(np.diff(places))
    return decay_rate(joint.modes) < 0 and swings.size > 2 and swings[-1] > swings[0]


def _come_down(joint: Joint, amplitudes, progress=None) -> tuple:
    """(Model, numerics, Solution) of a release that is long enough to come down from the largest amplitude to the
    smallest, as far as it swings on. It begins so high that its first reading lies above the largest. progress: told
    what a longer one and its coarser ones will take, by the seconds a cycle of the one before."""
    travel, many = joint.model.rig.travel, joint.modes.omega.size > 1
    begin, cycles, tries, each = min(BESIDE * float(amplitudes[-1]), travel), SHORT, 0, 0.0
    rest = _amplitude_of(joint, _deflected(joint)) if _limit(joint) else 0.0
    swing = SWINGS * 2 * np.pi / joint.modes.omega[joint.mode] if joint.modes.omega[joint.mode] else np.inf
    while True:
        model = released(joint, begin)
        what = replace(model, rig=replace(model.rig, cycles=float(cycles)))
        how = numerics.choose(what)
        most = TURNED if how.engine == PIECES.name and not many else LONGEST[many]
        if many or not (_rigid(joint.model) or how.engine == PIECES.name):  # these keep every turn of the output
            how = replace(how, window=int(cycles))
        if progress is not None and WITH_COARSER * each * cycles > TOLD:
            progress(f"decay over {cycles} cycles: about {WITH_COARSER * each * cycles:.2g} s of computing time")
        found = ENGINES[how.engine].run(what, how, joint.patch, 0, None, None)
        each = found.seconds / cycles
        if _grows(joint, found):
            raise _GrowingRelease("the release grows")
        read = _read(joint, found)
        if not read.time.size and (cycles >= most or found.response.time[-1] >= swing):
            return what, how, found
        if not read.time.size:  # cycles are those of the held mode, of which a swing in slip can last hundreds
            cycles = min(8 * cycles, most)
            continue
        high, low, zeta = read.amplitude[0], read.amplitude[-1], read.damping[-1]
        if high < amplitudes[-1] and begin < travel and tries < HIGHER:
            raised = max(FARTHEST * begin, BESIDE * (begin + 2 * rest))  # friction takes two deflections a half swing
            begin, tries = min(begin * BESIDE * amplitudes[-1] / high, raised, travel), tries + 1
        elif low <= BELOW * amplitudes[0] or cycles >= most or \
                read.time[-1] < found.response.time[-1] - 3 / read.frequency[-1]:  # it has come to rest
            return what, how, found
        else:
            further = np.log(low / (BELOW * amplitudes[0])) / (2 * np.pi * zeta) if zeta > 0 else np.inf
            cycles = int(min(np.clip(cycles + further, 2 * cycles, 8 * cycles), most))


def released(joint: Joint, amplitude: float) -> Model:
    """The model of a joint whose mode is released at an amplitude [m] of the output."""
    model, modes = decays.steadily(joint.model), joint.modes
    start = _start(joint, amplitude)
    period = 2 * np.pi / (joint.held[0] or modes.omega[joint.mode])
    rig = replace(model.rig, drive=drives.release(period), start=start, kind="free", waveform=NO_WAVEFORM,
                  frequency=None, levels=(), level_cycles=0.0, force=None)
    return replace(model, rig=rig)


def _start(joint: Joint, amplitude: float) -> Start:
    """Where a release begins, at an amplitude [m] of the output: in the free motion of a balance, so that no other mode
    rings beside it; where none is known in the shape of the mode, held or, once all of the contact slips, free."""
    modes, still = joint.modes, np.zeros(joint.modes.omega.size)
    if still.size > 1:
        try:
            _refuse(joint, "balance")
            first = min(float(_amplitude_of(joint, LOW * _knee(joint))) or amplitude, amplitude)
            path = np.geomspace(first, amplitude, STARTS)
            found = _motions(_group(joint, joint.patch), joint, path := np.unique(path), LADDER[0])
            if found[-1] is not None:
                turn = 1j * found[-1].omega * np.arange(LADDER[0] + 1)[:, None]
                return Start(found[-1].modal.real.sum(axis=0), (turn * found[-1].modal).real.sum(axis=0))
        except (NotConverged, PatchfemError):
            pass
    own = np.eye(still.size)[joint.mode]
    if amplitude > _amplitude_of(joint, _knee(joint)) and modes.output[joint.mode]:
        return Start(own * amplitude / abs(float(modes.output[joint.mode])), still)
    return Start(joint.held[1] * amplitude / joint.reach, still)


def _read(joint: Joint, found, turns=turns) -> DecayCurve:
    """The curve of a Solution, by its `turns`; beside other modes it turns when the part of the motion along the held
    shape does, which rings least. Where its swings last equally long nothing slips: the part along the held shape is
    then the mode's own motion, whatever else rings at the output."""
    motion, shape = found.response, joint.held[1]
    if shape.size == 1:
        return curve_of(of_turns(*turns(motion.time, motion.output, motion.output_rate)))
    times, places = turns(motion.time, *(part @ shape for part in (motion.modal, motion.modal_rate)))
    if times.size < 3:
        return curve_of(of_turns(times, places))
    sizes = np.abs(np.diff(CubicHermiteSpline(motion.time, motion.output, motion.output_rate)(times)))
    equal = np.abs(np.diff(last := np.diff(times))) <= EQUAL * last[1:]
    holds = np.append(True, equal) & np.append(equal, True)
    at_output = curve_of(of_turns(times, places, sizes))
    own = joint.reach / (shape @ shape) * np.abs(np.diff(places))
    alone = curve_of(of_turns(times, places, np.where(holds, own, sizes)))
    left = _coupled(joint) * np.abs(alone.damping - at_output.damping)
    left = sliding_window_view(np.pad(left, BEATS), 2 * BEATS + 1).max(axis=1) if left.size else left
    return alone._replace(damping_error=alone.damping_error + left,
                          frequency_error=alone.frequency_error + left * alone.frequency)


def _coupled(joint: Joint) -> float:
    """The share of what other modes change at the output that they change in the motion along the held shape, by the
    dampers that couple them: at most 1."""
    modes, shape, omega = joint.modes, joint.held[1], joint.held[0] or joint.modes.omega[joint.mode]
    shape, others = shape / np.linalg.norm(shape), np.delete(modes.omega, joint.mode)
    pulled, output = (part - shape * (shape @ part) for part in (modes.dampers @ shape, modes.output))
    apart = np.abs(others - omega**2 / np.maximum(others, omega)).min()
    seen = np.linalg.norm(output) / joint.reach
    return float(np.clip(np.linalg.norm(pulled) / max(apart * seen, 1e-300), 0.0, 1.0))


def _with_errors(joint: Joint, what: Model, how, found, amplitudes) -> tuple:
    """((2, k) frequency [Hz] and damping at amplitudes (k,) of a release, (2, k) what reading them leaves open, (2, k)
    what coarser runs change)."""
    engine, read, made = ENGINES[how.engine], _read(joint, found), {}
    if how.engine == SMOOTH.name:
        read = read.unsampled(_read(joint, found, turns_from_outside))
    read = read.over(amplitudes)
    best = np.array([read.frequency, read.damping])
    reading, error = np.array([read.frequency_error, read.damping_error]), ROUND * np.abs(best)

    def curve(variant) -> np.ndarray:
        if variant not in made:
            run = engine.run(what, replace(variant.numerics, whole=True), variant.patch, 0, None, None)
            one = _read(joint, run).over(amplitudes)
            made[variant] = np.array([one.frequency, one.damping])
        return made[variant]

    ways = [*engine.in_time(what, how, joint.patch), *engine.in_space(what, how, joint.patch, joint.coarse, found)]
    for way in ways:
        if way.runs:
            beside = best if way.beside is None else curve(way.beside)
            runs = way.runs if way.of == "cells" else way.runs[:1]
            # NaN where one of them does not come down so far
            error += np.max([np.abs(curve(one) - beside) for one in runs], axis=0)
    return best, reading, error


FIND = {"balance": _balanced, "quasi-static": _static}


def _put_together(joint: Joint, wanted, curves: dict, missing: dict) -> Backbone:
    """The Backbone of the curves found at amplitudes (k,) [m] that were asked for."""
    modes = joint.model.rig.modes
    name = f"{joint.mode + 1}"
    if joint.model.rig.by_modes:
        own = np.eye(modes.omega.size) if modes.shapes is None else np.abs(modes.shapes)
        name = modes.names[int(np.argmax(own[:, joint.mode]))]
    own, (stuck, off) = _free_frequency(joint), _stuck_frequency(joint)
    first = next((curves[way] for way in ("quasi-static", "balance") if way in curves), None)
    micro, gross = _exponents(joint, first) if first is not None and not joint.linear else (None, None)
    flutter = next((found for way, curve in curves.items()
                    if (found := _flutter_amplitude(joint, way, curve)) is not None), None)
    return Backbone(name, own, stuck, curves, missing, micro, gross, flutter,
                    (*_unrubbed(joint), *_gaps(wanted, curves), *([] if joint.linear else _differences(curves)),
                     *_regimes(joint, wanted, micro), *_unmeshed(joint),
                     *(note for one in curves.values() for note in one.notes),
                     *_secant(joint, wanted, curves), *_unworn(joint.model)),
                    None if joint.linear else _expected(joint), off)


def _stuck_frequency(joint: Joint) -> tuple:
    """Of the mode [Hz] with the contact held and its error, None where nothing gives way: behind pieces alone that give
    way from the stiffness that a run of the patch prints, extrapolated over its meshes."""
    model, modes = joint.model, joint.modes
    if joint.held[0] is None:
        return None, None
    told = held_patch(model, joint.patch, joint.apart)
    if told is None or len(modes.interfaces) > 1 or model.rig.taken is not None:  # the last: held as it was measured
        return joint.held[0] / (2 * np.pi), None
    value, high = (modes.held(modes.interfaces, np.array([one]), joint.mode)[0] / (2 * np.pi)
                   for one in (told.value, told.value + told.error))
    return value, high - value


def _free_frequency(joint: Joint) -> float:
    """Of the mode [Hz] without the contact and with the bonded spring, one that bends as stiff as it is at rest."""
    modes, spring = joint.modes, joint.model.rig.interlock
    omega = float(modes.omega[joint.mode])
    if spring is not None:
        omega = modes.held(modes.interfaces[:1], np.array([spring[0]]), joint.mode)[0]
    return omega / (2 * np.pi)


def _exponents(joint: Joint, one: Curve) -> tuple:
    """Slopes of the logarithm of the loss over that of the amplitude: between the first and the last point in
    micro-slip, and between the last two at which all of the contact slips; None where there are no two. A loss counts
    that is RESOLVED times its error, and no round-off of the energy of the swing."""
    a, loss, knee = one.amplitude, one.loss, _amplitude_of(joint, _knee(joint))
    if a.size < 2 or not _limit(joint):
        return None, None
    swing = joint.modes.mass * (2 * np.pi * one.frequency * a / joint.reach)**2
    known = loss > np.maximum(ROUND, RESOLVED * 2 * np.pi * one.damping_error) * swing
    micro, gross = (np.flatnonzero(known & there) for there in (a < MICRO * knee, a > GROSS * knee))
    return tuple(float(np.log(loss[j] / loss[i]) / np.log(a[j] / a[i])) if i != j else None
                 for i, j in ((micro[0], micro[-1]) if micro.size else (0, 0), (gross[-2:][0], gross[-1]) if gross.size
                              else (0, 0)))


def _expected(joint: Joint) -> float | None:
    """Exponent of the loss in micro-slip by theory: chi + 3 of sliders (Segalman), 3 of bonds and of pieces whose
    pressure falls to 0 at its edges (Cattaneo, Mindlin); None of others."""
    f = joint.model.friction
    if f is None or not _limit(joint):
        return None
    if has(f.law, "cells"):
        return f.chi + 3
    return 3.0 if has(f.law, "bonds") or joint.model.soft or joint.model.rig.soft else None


def _regimes(joint: Joint, wanted, micro: float | None) -> list:
    """Sentences on amplitudes (k,) [m] that begin beyond micro-slip, or tell no exponent there."""
    if joint.linear or _expected(joint) is None or micro is not None:
        return []
    edge = MICRO * _amplitude_of(joint, _knee(joint))
    if wanted[0] > edge:
        return [f"the smallest amplitude, {say(wanted[0], 3)}, lies above the range of micro-slip, which ends at about "
                f"{say(edge, 2)}; to get the exponent of micro-slip, begin --amplitudes at "
                f"{say(LOW / MICRO * edge, 2)}"]
    return [f"the exponent of micro-slip cannot be determined: fewer than two amplitudes below {say(edge, 2)} have an "
            f"energy loss of at least {RESOLVED:g} times the error of the loss; give amplitudes up to {say(edge, 2)}, "
            "or a smaller accuracy.tolerance"]


def _flutter_amplitude(joint: Joint, way: str, curve: Curve) -> float | None:
    """Find the largest amplitude [m] at which the damping falls through zero.

    The curve gives the two amplitudes between which the root lies. Brent's method on damping × amplitude, which is
    a straight line under Coulomb friction, computes further points of the same curve. None without such a root.
    """
    falls = np.flatnonzero((curve.damping[:-1] > 0) & (curve.damping[1:] <= 0))
    if not falls.size:
        return None
    bracket = slice(falls[-1], falls[-1] + 2)
    low, high = np.log(curve.amplitude[bracket])
    loss_low, loss_high = (curve.damping * curve.amplitude)[bracket]
    known = {low: loss_low, high: loss_high}

    def net_loss(log_amplitude: float) -> float:
        if log_amplitude not in known:
            amplitude = np.array([np.exp(log_amplitude)])
            point = _curve(joint._replace(errors=False), amplitude, way)
            known[log_amplitude] = float(point.damping[0] * amplitude[0])
        return known[log_amplitude]

    try:
        return float(np.exp(brentq(net_loss, low, high, xtol=FLUTTER_TOL)))
    except (NotConverged, PatchfemError):  # no further point is known: the chord between the two points
        amplitudes = curve.amplitude[bracket]
        return float(amplitudes[0] + loss_low / (loss_low - loss_high) * (amplitudes[1] - amplitudes[0]))


def _unrubbed(joint: Joint) -> tuple:
    rubs = joint.model.friction is not None or joint.model.rig.interfaces
    return ("no friction acts, so frequency and damping are the same at all amplitudes",) if joint.linear and rubs \
        else ()


def _unworn(model: Model) -> tuple:
    return () if model.wear is None else ("these curves are for unworn pieces: [wear] is ignored",)


def _unmeshed(joint: Joint) -> tuple:
    """That no coarser mesh tells the error of a contact which slips part by part."""
    model = joint.model
    if joint.linear or not model.soft or joint.coarse is not None:
        return () if joint.linear or not model.rig.soft or faces.known(model) else (SPARSE + faces.UNKNOWN,)
    cure = "split the elements of contact.mesh" if model.patch.mesh is not None else "leave out contact.element_size"
    return (f"{SPARSE}the interface has too few elements for a coarser mesh; {cure}",)


SPARSE = "the errors of the curves do not account for the mesh, because no coarser mesh was computed: "
LEFT_OUT = {"balance": "harmonic balance did not converge at these amplitudes; the curve may turn back to smaller "
                       "amplitudes, or the mode may stop oscillating",
            "quasi-static": "the static curve does not reach these amplitudes",
            "decay": "at these amplitudes the free decay, or a coarser decay computed as a check, gave no frequency "
                     "and damping, or the decay was no longer a motion of this mode alone"}


def _gaps(wanted, curves: dict) -> list:
    """Sentences on the amplitudes (k,) [m] that a curve does not have."""
    out = []
    for way, one in curves.items():
        lacks = wanted[~np.isin(wanted, one.amplitude)]
        if lacks.size and one.amplitude.size < wanted.size:
            left = f"lie from {say(lacks[0], 3)} to {say(lacks[-1], 3)}" if lacks.size > FEW else \
                f"are {', '.join(say(each, 3) for each in lacks)}"
            out.append(f"method {way}: {one.amplitude.size} of {wanted.size} amplitudes have a result; the amplitudes "
                       f"without a result {left}: "
                       f"{LEFT_OUT[way]}")
    return out


def _secant(joint: Joint, wanted, curves: dict) -> list:
    """A sentence on what a static curve in slip is, where no balance stands beside it."""
    slips = not joint.linear and _limit(joint) and wanted[-1] > MICRO * _amplitude_of(joint, _knee(joint))
    return ["--method quasi-static takes the stiffness from the two turning points of the motion under a force of "
            "fixed shape; --method balance takes the stiffness from the first harmonic of the force, and this "
            "stiffness is lower once the contact slips. The frequencies by quasi-static are therefore higher than the "
            "frequencies by balance"] \
        if slips and "quasi-static" in curves and "balance" not in curves else []


WHY = {"decay": "a decay gives mean values over a cycle, and at this amplitude one cycle reduces the amplitude by the "
                "fraction {:.2g}",
       "quasi-static": "the static curve uses the secant stiffness under a force of fixed shape; harmonic balance uses "
                       "the first harmonic of the force"}


def _differences(curves: dict) -> list:
    """Sentences on where the decay and the static curve leave the balance beyond their errors at the same amplitudes,
    and why."""
    if "balance" not in curves:
        return []
    out, best = [], curves["balance"]
    for way, why in WHY.items():
        if way not in curves:
            continue
        one, here, there = curves[way], *np.intersect1d(curves[way].amplitude, best.amplitude, return_indices=True)[1:]
        one, other = one.at(here), best.at(there)
        for what in ("frequency", "damping"):
            beside, bar = getattr(other, what), getattr(other, f"{what}_error")
            off = np.abs(getattr(one, what) - beside)
            share = np.where(off > bar + getattr(one, f"{what}_error"), off / np.abs(beside), 0.0)
            if share.size and share.max() > 0:
                k = int(np.argmax(share))
                lost = -np.expm1(-2 * np.pi * one.damping[k])
                times = getattr(one, what)[k] / beside[k]
                by = f"where the value by {way} is {times:.2g} times the value by balance" if times >= 2 else \
                    f"by {100 * share[k]:.2g} %"
                also = "" if one.others is None or not one.others[k] > HEARD else \
                    f"; the motion of other modes in the decay is {100 * one.others[k]:.2g} % of its amplitude"
                out.append(f"the values of {what} by {way} and by balance differ most at the amplitude "
                           f"{say(one.amplitude[k], 3)}, {by}: "
                           f"{why.format(lost)}{also}")
    return out
