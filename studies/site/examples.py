"""The scene that shows each effect: a scene to begin with, and the tables that name the effect.

A table of an example takes the place of the table of the same name. `FILES` stand beside the scenes that read them.
"""

import os
import re

import numpy as np

PATCH = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
[accuracy]
tolerance = 1e-2
"""
LAW = """\
[friction]
law = "coulomb"
static = 0.3
"""
SLIDE = """\
[slide]
kind = "sine"
amplitude = "2 um"
frequency = "1 Hz"
cycles = 2
"""
POINT = '[normal]\nload = "115 N"\n' + LAW + SLIDE + "[accuracy]\ntolerance = 1e-2\n"
BONDS = POINT.replace('law = "coulomb"', 'law = "nonlocal"\nbond_length = "1 um"')
RIG = (
    '[normal]\nload = "115 N"\n'
    + LAW
    + """\
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 40
[accuracy]
tolerance = 1e-2
"""
)
SOFT = RIG.replace('law = "coulomb"', 'law = "elastic-plastic"\nbond_length = "1 um"')
CHAIN = """\
[structure]
output_mass = 1
[[structure.interface]]
between = [1, 0]
law = "elastic-plastic"
static = 0.4
load = "50 N"
bond_length = "1 um"
""" + RIG[RIG.index("[drive]") :]


def law(name: str, keys: str = "") -> tuple:
    """Return the scene of a contact point with a friction law."""
    return POINT, f'[friction]\nlaw = "{name}"\nstatic = 0.3\n{keys}'


def method(name: str, start: str = SOFT) -> tuple:
    """Return the scene of a rig whose motion is computed by a method."""
    return start, f'[accuracy]\ntolerance = 1e-2\nmethod = "{name}"\n'


def drive(rows: str) -> tuple:
    """Return the scene of a rig under a drive."""
    return RIG, "[drive]\n" + rows


def reading(rows: str) -> tuple:
    """Return the scene of a rig with measured values of an accelerometer."""
    return RIG, f'[measured]\nfile = "readings.csv"\n{rows}'


ENVIRON = {
    name: os.environ[name]
    for name in ("PATH", "HOME", "PYTHONPATH", "XDG_CACHE_HOME", "PATCHFEM_CACHE")
    if name in os.environ
}
GROOVES = 'wavelength = "80 um"\namplitude = "2 um"\n'
BOND = 'bond_length = "1 um"\n'
GROWING_BONDS = (
    f'[friction]\nlaw = "nonlocal"\nstatic = 0.3\nkinetic = 0.2\n{BOND}rest_growth = "1e-3 m/s^2"\nslip_growth = '
    '"1 um"\n'
)
SINE = 'frequency = "143 Hz"\nacceleration = "5 g"\n'
EXAMPLES = {
    "contact": (PATCH, ""),
    "contact.coating": (PATCH, '[contact.coating]\nmaterial = "WC-Co"\nthickness = "6 mil"\n'),
    "contact.upper": (PATCH, '[contact.upper]\nlength = "8 mm"\nend_radius = "1 mm"\n'),
    "contact.lower": (PATCH, '[contact.lower]\nsubstrate = "steel"\nheight = "10 mm"\n'),
    "contact.approach": (
        PATCH.replace('load = "26 lbf"\n', ""),
        '[contact.approach]\ndistance = "50 nm"\n',
    ),
    "contact.holder": (
        PATCH,
        '[contact.tilt]\nangle = "0.1 mrad"\n[contact.holder]\nrotational_stiffness = '
        '"100 N m/rad"\n',
    ),
    "contact.step": (PATCH, '[contact.step]\nheight = "0.1 um"\nat = "2 mm"\n'),
    "contact.asperities.law=linear": (
        PATCH,
        '[contact.tilt]\nangle = "0.1 mrad"\n[contact.asperities]\nlaw = "linear"'
        '\nnormal_stiffness = "1e13 Pa/m"\n',
    ),
    "contact.asperities.law=exponential": (
        PATCH,
        '[contact.tilt]\nangle = "0.1 mrad"\n[contact.asperities]\nlaw = '
        '"exponential"\ndecay_length = "0.1 um"\n',
    ),
    "contact.asperities.law=hertz": (
        PATCH,
        '[contact.tilt]\nangle = "0.1 mrad"\n[contact.asperities]\nlaw = "hertz"\n'
        'radius = "50 um"\ndensity = "1e10 1/m^2"\nheight_deviation = "0.5 um"\n',
    ),
    "contact.tilt": (PATCH, '[contact.tilt]\nangle = "0.1 mrad"\n'),
    "contact.load_line": (PATCH, '[contact.load_line]\noffset = "1 mm"\n'),
    "contact.crown": (PATCH, '[contact.crown]\nradius = "10 m"\n'),
    "contact.profile": (PATCH, '[contact.profile]\nfile = "trace.csv"\nheights = "surface"\n'),
    "contact.area": (PATCH, "[contact.area]\ncells = 64\n"),
    "contact.shear": (
        PATCH + '[contact.crown]\nradius = "10 m"\n' + LAW + SLIDE,
        "[contact.shear]\n",
    ),
    "contact.grooves": (
        PATCH + LAW + SLIDE,
        f'[contact.grooves]\n{GROOVES}[slide]\nkind = "sine"\namplitude = '
        '"30 um"\nfrequency = "1 Hz"\ncycles = 2\n',
    ),
    "normal": (POINT, ""),
    "normal.grooves": (
        POINT,
        f'[normal.grooves]\n{GROOVES}[slide]\nkind = "sine"\namplitude = "30 um"\nfrequency = '
        '"1 Hz"\ncycles = 2\n',
    ),
    "friction.law=coulomb": law("coulomb"),
    "friction.law=tanh": law("tanh", 'reference_speed = "2 um/s"\n'),
    "friction.law=elastic-plastic": law("elastic-plastic", BOND),
    "friction.law=nonlocal": law("nonlocal", BOND),
    "friction.law=convolution": (
        PATCH + '[contact.tilt]\nangle = "0.05 mrad"\n' + LAW + SLIDE,
        '[friction]\nlaw = "convolution"\nstatic = 0.3\nbond_length = "0.5 mm"\n',
    ),
    "friction.law=iwan": law("iwan", 'stiffness = "1e8 N/m"\nchi = -0.5\nbeta = 0.5\n'),
    "friction.law=bouc-wen": law("bouc-wen", 'stiffness = "1e8 N/m"\nexponent = 2.0\n'),
    "friction.law=lugre": law(
        "lugre", 'kinetic = 0.2\nstiffness = "1e8 N/m"\nstribeck_speed = "5 um/s"\n'
    ),
    "friction.reading=stretch": law("nonlocal", BOND + 'reading = "stretch"\n'),
    "friction.reading=report": law("nonlocal", BOND + 'reading = "report"\n'),
    "friction.temperature": (
        POINT.replace(LAW, GROWING_BONDS),
        '[friction.temperature]\nsurface = "600 K"\nreference = "293 K"'
        '\nslip_activation = "1000 K"\n',
    ),
    "slide.kind=constant": (
        BONDS,
        '[slide]\nkind = "constant"\nspeed = "1 um/s"\ndistance = "6 um"\n',
    ),
    "slide.kind=sine": (BONDS, ""),
    "slide.kind=triangle": (
        BONDS,
        '[slide]\nkind = "triangle"\namplitude = "3 um"\nspeed = "2 um/s"\ncycles = 2\n',
    ),
    "slide.kind=dwell": (
        POINT.replace(LAW, GROWING_BONDS),
        '[slide]\nkind = "dwell"\nspeed = "10 um/s"\ndistance = "8 um"\n'
        'hold = "1 s"\ndistance_after = "8 um"\n',
    ),
    "slide.kind=file": (BONDS, '[slide]\nkind = "file"\nfile = "path.csv"\n'),
    "structure": (RIG, ""),
    "structure.bonded": (RIG, '[structure.bonded]\nstiffness = "1e5 N/m"\n'),
    "structure.reduced": (
        CHAIN,
        '[structure.reduced]\nstiffness = "k.mtx"\nmass = "m.mtx"\ndamping = 0.003\n'
        "boundary = [6]\nmodes = 3\n",
    ),
    "structure.start": (RIG, '[structure.start]\ndisplacement = ["0.1 mm"]\n'),
    "drive.kind=base": drive('kind = "base"\n' + SINE + "cycles = 40\n"),
    "drive.kind=force": drive(
        'kind = "force"\nfrequency = "143 Hz"\nforce = "45 N"\ncycles = 40\n'
    ),
    "drive.kind=free": drive('kind = "free"\ndisplacement = "0.5 mm"\ncycles = 10\n'),
    "drive.waveform=sine": drive('kind = "base"\n' + SINE + "cycles = 40\n"),
    "drive.waveform=step": drive(
        'kind = "base"\nwaveform = "step"\nacceleration = "6 g"\ncycles = 10\n'
    ),
    "drive.waveform=sweep": drive(
        'kind = "base"\nwaveform = "sweep"\nfrom = "135 Hz"\nto = "150 Hz"\nrate = "15 Hz/s"'
        '\nacceleration = "4.5 g"\n'
    ),
    "drive.waveform=levels": drive(
        'kind = "base"\nwaveform = "levels"\nfrequency = "143 Hz"\nlevels = ["3 g", "4 g", '
        '"4.5 g", "5 g"]\ncycles = 40\n'
    ),
    "drive.waveform=file": drive('kind = "base"\nwaveform = "file"\nfile = "shock.csv"\n'),
    "drive.waveform=tones": drive(
        'kind = "base"\nwaveform = "tones"\nfrequencies = ["140 Hz", "145 Hz"]\n'
        'accelerations = ["3 g", "3 g"]\ncycles = 140\n'
    ),
    "drive.waveform=random": drive(
        'kind = "base"\nwaveform = "random"\nspectrum = "0.02 g^2/Hz"\nfrom = "50 Hz"\nto = '
        '"500 Hz"\nduration = "4 s"\n'
    ),
    "structure.stiffening": (SOFT, '[structure.stiffening]\ncubic = "1e15 N/m^3"\n'),
    "accuracy.method=exact": method("exact", RIG),
    **{f"accuracy.method={name}": method(name) for name in ("march", "harmonic")},
    "wear": (
        PATCH + '[contact.tilt]\nangle = "0.05 mrad"\n' + LAW + SLIDE.replace("2 um", "15 um"),
        '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 100000\n',
    ),
    "wear.friction": (
        PATCH
        + LAW
        + SLIDE.replace("2 um", "15 um")
        + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = '
        "100000\n",
        '[wear.friction]\ndepth = ["0 um", "0.5 um"]\ncoefficient_factor = [1, 1.3]\n',
    ),
    "measured": reading(""),
    "measured.reading=fundamental": reading('reading = "fundamental"\n'),
    "measured.reading=rms": reading('reading = "rms"\n'),
    "measured.reading=lowpass": reading('reading = "lowpass"\nreading_cutoff = "600 Hz"\n'),
    "sweep": (PATCH, '[sweep]\n"contact.tilt.angle" = "1e-6 rad..1e-3 rad:7"\n'),
}


def _table(head: str, *columns) -> str:
    return (
        "\n".join([head, *(",".join(f"{value:.6g}" for value in row) for row in zip(*columns))])
        + "\n"
    )


def _matrix(entries) -> str:
    """Return a symmetric matrix of entries (row, column, value), counted from 1, in Matrix Market format."""
    size = max(row for row, _, _ in entries)
    return (
        "\n".join(
            [
                "%%MatrixMarket matrix coordinate real symmetric",
                f"{size} {size} {len(entries)}",
                *(f"{row} {column} {value:g}" for row, column, value in entries),
            ]
        )
        + "\n"
    )


_X = np.linspace(0, 12.7, 301)
_T = np.linspace(0, 0.05, 201)
FILES = {
    "trace.csv": _table(
        "x [mm],z [um]", _X, 0.05 * np.sin(2 * np.pi * _X / 3) + 0.02 * np.sin(2 * np.pi * _X / 0.7)
    ),
    "path.csv": _table("time [s],displacement [um]", [0, 1, 2, 4], [0, 4, -2, 3]),
    "shock.csv": _table(
        "time [s],acceleration [g]", _T, 8 * np.sin(np.pi * _T / 0.01) * (_T < 0.01)
    ),
    "k.mtx": _matrix(
        [(k, k, 1e6 if k == 6 else 2e6) for k in range(1, 7)]
        + [(k + 1, k, -1e6) for k in range(1, 6)]
    ),
    "m.mtx": _matrix([(k, k, 0.1) for k in range(1, 7)]),
    "readings.csv": "frequency [Hz],input [g],acceleration [g],displacement [mil],flag\n143,5,5.4,0.6,\n",
}


def blocks(text: str) -> dict:
    """Return {header: text} of each table of a scene, in order."""
    parts = re.split(r"^(?=\[)", text, flags=re.M)
    return {part.partition("\n")[0]: part for part in parts if part.strip()}


def scene(effect: str) -> str:
    """Return the complete scene that shows an effect."""
    start, more = EXAMPLES[effect]
    return "".join((blocks(start) | blocks(more)).values())
