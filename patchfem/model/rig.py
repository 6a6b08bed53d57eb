"""The rig that a scene asks for: modes, drive, start, interfaces and springs, built once. Nothing is solved."""

from dataclasses import dataclass

import numpy as np

from ..core import ModalBasis, Start
from ..structure.drive_sizes import omega_of, peak_speed
from .drive import cycles_of, cycles_per_level, drive_of, levelled
from .law import interface_names, rubbings_of
from .structure import acts, first_of, frequencies, modes_of, notes_of, own_modes, start_of, yaws


@dataclass(frozen=True, eq=False, slots=True)
class Rig:
    """Modes with their drive and what rubs on them.

    start: None at rest. kind: "base", "force" or "free"; waveform as in the scene; frequency [Hz] of a sine or of
    levels, else None; levels: accelerations [m s-2] of a drive in levels, or forces over the modal mass, level_cycles
    of each; onset: what their onset means, (kind, length [m] or None); cycles of the whole run; force [N] of a force
    drive, else None. interfaces: a Rubbing each, none in a linear rig; names: of interfaces between masses.
    load_varies: the normal load changes with the motion or in time; strips_slide_apart: modes yaw a patch in strips.
    travel [m], infinite without a stop; cubic [N/m3] stiffening at the output or None; interlock: (stiffness [N/m],
    wavelength [m]) of a bonded spring that bends, or None. mass [kg] and own_frequency [Hz] of the first mode that is
    not rigid; frequencies (n,) [Hz]; by_modes: the scene lists modes; notes: on a structure file.
    """

    modes: ModalBasis
    drive: object
    start: Start | None
    kind: str
    waveform: str
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
    onset: tuple = ("distortion", None)

    @property
    def speed(self) -> float:
        """Scale of the speeds to expect [m/s], from drive and start; the default floor of the speed in 2.10 follows
        from it."""
        return peak_speed(self.drive, self.start)

    @property
    def displacement(self) -> float:
        """Scale of the displacements to expect [m], from drive and start: the speed over the omega of the drive."""
        return self.speed / omega_of(self.drive)

    @property
    def stiffness(self) -> float:
        """Stiffness K = mass omega_1^2 [N/m] of the first mode that is not rigid, without the bonded spring; 0: all are
        rigid."""
        return self.mass * (2 * np.pi * self.own_frequency)**2 if self.own_frequency else 0.0

    @property
    def bends(self) -> bool:
        """Whether springs beside the contact are not linear."""
        return self.cubic is not None or self.interlock is not None


def rig_asked(scene) -> Rig:
    """The rig of a scene with [structure] and [drive]; PatchfemError for files or starts that cannot be used."""
    structure, asked, alone = scene.structure, scene.drive, own_modes(scene)
    modes = modes_of(scene, alone)
    drive, bonded = drive_of(scene, modes), structure.bonded
    own, mass = first_of(scene, alone)
    rows = levelled(asked)
    bends = bonded is not None and bonded.wavelength is not None
    return Rig(modes, drive, start_of(scene, modes), asked.kind, asked.waveform, asked.frequency,
               tuple(part.amplitude for part in drive.segments) if rows else (),
               cycles_per_level(asked) if rows else 0.0, float(cycles_of(asked, drive)),
               asked.force if asked.kind == "force" else None, rubbings_of(scene), tuple(interface_names(structure)),
               acts(scene), yaws(scene), structure.travel or np.inf,
               structure.stiffening.cubic if structure.stiffening is not None else None,
               (bonded.stiffness, bonded.wavelength) if bends else None,
               bonded.stiffness if bonded is not None else None, mass, own, frequencies(structure, modes),
               bool(structure.mode), tuple(notes_of(scene)), (asked.onset, asked.onset_length))
