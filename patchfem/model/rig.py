"""The rig that a scene asks for: modes, drive, start, interfaces and springs, built once. Nothing is solved."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..core import ModalBasis, Start
from ..effects import Waveform, waveform_of
from ..structure.drive_sizes import decay_rate, drive_omega, peak_speed
from .drive import cycles_of, cycles_per_level, drive_of, levelled
from .law import interface_laws_of, interface_names
from .structure import (
    acts,
    first_of,
    frequencies,
    modes_of,
    notes_of,
    of_a_patch,
    own_modes,
    richer_modes,
    start_of,
    yaws,
)

BEYOND = 1e3  # m, past which nobody follows a motion that a mode of damping below 0 or a softening spring drives
NOTHING = 1e-9  # of the largest slide of a mode: one below it is round-off


@dataclass(frozen=True, eq=False, slots=True)
class Rig:
    """Modes with their drive and what rubs on them.

    start: None at rest. kind: "base", "force" or "free"; waveform of the drive; frequency [Hz] of a sine or of
    levels, else None; levels: accelerations [m s-2] of a drive in levels, or forces over the modal mass, level_cycles
    of each; onset: what their onset means, (kind, length [m] or None); cycles of the whole run; force [N] of a force
    drive, else None. interfaces: an InterfaceLaw each, none in a linear rig; names: of interfaces between masses.
    load_varies: the normal load changes with the motion or in time; strips_slide_apart: modes yaw a patch in strips.
    travel [m], without a stop infinite, or BEYOND beside a mode that gains energy or a spring that softens; cubic
    [N/m3] stiffening at the output or None; interlock: (stiffness [N/m], wavelength [m]) of a bonded spring that bends,
    or None. mass [kg] and own_frequency [Hz] of the first mode that is not rigid; frequencies (n,) [Hz]; by_modes: the
    scene lists modes; notes: on a structure file; parts (p, n): slide of the first interface in each of the scene's own
    modes, that first one before the others, per coordinate; contact_mass [kg]: modal mass of that mode over
    slide_1^2, 0 where it leaves the interface at rest; stuck(stiffness [N/m]) -> the Rig without the joint, of modes
    that were measured with one that a patch holds, which is not pressed yet; None of any other. richer: the rig
    of a reduced structure with more of its modes, None where none is left out; kept: notes on what is left of it;
    taken: stiffness [N/m] of the joint that was taken off modes measured with it, None of others; most: how many
    modes a reduced structure can keep, 0 of others.
    """

    modes: ModalBasis
    drive: object
    start: Start | None
    kind: str
    waveform: Waveform
    frequency: float | None
    levels: tuple
    level_cycles: float
    cycles: float
    force: float | None
    interfaces: tuple
    names: tuple
    load_varies: bool
    strips_slide_apart: bool
    travel: float
    cubic: float | None
    interlock: tuple | None
    bonded: float | None
    mass: float
    own_frequency: float
    frequencies: np.ndarray
    by_modes: bool
    notes: tuple
    parts: np.ndarray
    contact_mass: float
    onset: tuple = ("distortion", None)
    stuck: Callable | None = None
    richer: "Rig | None" = None
    kept: tuple = ()
    taken: float | None = None
    most: int = 0

    @property
    def speed(self) -> float:
        """Scale of the speeds to expect [m/s], from drive and start; the default floor of the speed in 2.10 follows
        from it."""
        return peak_speed(self.drive, self.start)

    @property
    def displacement(self) -> float:
        """Scale of the displacements to expect [m], from drive and start: the speed over the omega of the drive."""
        return self.speed / drive_omega(self.drive)

    @property
    def stiffness(self) -> float:
        """Stiffness mass omega_1^2/slide_1^2 [N/m] of the first mode that is not rigid as the contact meets it, without
        the bonded spring; 0: all are rigid, or it leaves the contact at rest.

        The mode moves the contact by slide_1 per unit of its coordinate, so (mass omega_1^2/2)(A/slide_1)^2 is its
        energy at a slide of A.
        """
        return self.contact_mass * (2 * np.pi * self.own_frequency) ** 2

    def beside_first(self, modal) -> float:
        """Share of the slide's range that the largest of the other modes carries, of coordinates modal (k, n) [m]; 0
        where nothing slides."""
        moved = np.asarray(modal) @ self.parts.T
        whole = float(np.ptp(moved.sum(axis=1), axis=0))
        return float(np.ptp(moved[:, 1:], axis=0).max(initial=0.0)) / whole if whole > 0 else 0.0

    @property
    def soft(self) -> bool:
        """Whether a patch of an interface of its own slips part by part."""
        return any(one.soft for one in self.interfaces)

    @property
    def bends(self) -> bool:
        """Whether springs beside the contact are not linear."""
        return self.cubic is not None or self.interlock is not None


def rig_asked(scene, joint: float | None = None) -> Rig:
    """The rig of a scene with [structure] and [drive]; PatchfemError for files or starts that cannot be used.

    joint: stiffness [N/m] of a pressed patch, taken off modes that were measured with it.
    """
    (more, kept, most), faces = richer_modes(scene), interface_laws_of(scene)
    return replace(
        _rig(scene, own_modes(scene, joint), faces, joint),
        kept=tuple(kept),
        taken=joint,
        most=most,
        richer=None if more is None else _rig(scene, more, faces),
    )


def _rig(scene, alone: ModalBasis, faces: tuple, joint: float | None = None) -> Rig:
    """The rig of a scene with the coordinates `alone`, as `own_modes` gives them; faces: its InterfaceLaws."""
    structure, asked = scene.structure, scene.drive
    modes = modes_of(scene, alone)
    drive, bonded = drive_of(scene, modes), structure.bonded
    own, mass = first_of(scene, alone)
    rows = levelled(asked)
    bends = bonded is not None and bonded.wavelength is not None
    cubic = structure.stiffening.cubic if structure.stiffening is not None else None
    return Rig(
        modes,
        drive,
        start_of(scene, modes),
        asked.kind,
        waveform_of(asked),
        asked.frequency,
        tuple(part.amplitude for part in drive.segments) if rows else (),
        cycles_per_level(asked) if rows else 0.0,
        float(cycles_of(asked, drive)),
        asked.force if asked.kind == "force" else None,
        faces,
        tuple(interface_names(structure)),
        acts(scene),
        yaws(scene),
        structure.travel or (BEYOND if decay_rate(modes) < 0 or (cubic or 0.0) < 0 else np.inf),
        cubic,
        (bonded.stiffness, bonded.wavelength) if bends else None,
        bonded.stiffness if bonded is not None else None,
        mass,
        own,
        frequencies(structure, modes),
        bool(structure.mode),
        tuple(notes_of(scene)),
        *_contact(alone, modes),
        (asked.onset, asked.onset_length),
        partial(rig_asked, scene)
        if structure.measured == "stuck" and joint is None and of_a_patch(scene)
        else None,
    )


def _contact(own: ModalBasis, modes: ModalBasis) -> tuple:
    """(parts, contact_mass) of a Rig; own: its modes without the bonded spring, modes: its coordinates."""
    slide = own.interfaces[0] if len(own.interfaces) else own.output
    held = np.flatnonzero(own.omega > 0)
    first = int(held[0]) if held.size else 0
    # z of own from z of modes: the shapes of both say where the same masses are
    turned = np.eye(slide.size)
    if modes is not own and modes.shapes is not None:
        turned = (
            modes.shapes
            if own.shapes is None
            else np.linalg.lstsq(own.shapes, modes.shapes, rcond=None)[0]
        )
    order = [first, *(k for k in range(slide.size) if k != first)]
    lost = abs(slide[first]) <= NOTHING * np.abs(slide).max(initial=0.0)
    return (slide[:, None] * turned)[order], 0.0 if lost else float(own.mass / slide[first] ** 2)
