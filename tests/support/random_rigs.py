"""Random rigs for the engine `event_driven`, with their measures by an independent program.

`random_rigs.json` has a spec of plain numbers for each rig: modes, faces, drive, start and cycles in SI units. They were
drawn by chance: 1 to 5 modes of 60 to 400 Hz with damping ratios of 0.1 to 3 %; 1 to 4 interfaces, each with one of the
laws; 8 to 20 cycles of a sine, of three tones or of a record, or a release. A third of the rigs whose laws allow it have
loads that oscillate or follow the motion, of which a third lift off. The values beside a spec are those of
`tests/support/hybrid_campaign.py` of version 1.10, which integrates the equations by DOP853 from event to event. Since 1.15
its slip of elastic-plastic springs under a load that varies is the slide minus their mean stretch.
"""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from patchfem.core import ModalBasis
from patchfem.event_driven import cases, drives, runs
from patchfem.event_driven.laws import make_law, masing
from patchfem.event_driven.records import LawNumbers
from patchfem.friction import make_law as make_friction_law
from patchfem.model import make_bond_parameters
from patchfem.runs.rig.engines import estimate_event_driven_errors

# Names of the rigs are the seeds by which they were drawn.
RIGS = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))
REFERENCE_ERROR = 1e-6  # relative, of the independent program
ZERO = 1e-12  # relative to the values that the drive alone would give


def make_interface_law(face: dict) -> LawNumbers:
    """Return the law of an interface for the engine."""
    keys = face["keys"]
    if keys["law"] == "jenkins":
        return masing.from_elements(*map(np.array, keys["elements"]))
    varies = face["amplitude"] != 0 or face["stiffness"] != 0
    table = SimpleNamespace(**keys)
    if table.law == "elastic-plastic" and table.bond_length is None:
        table.bond_length = table.static * face["load"] / table.stiffness
    has_bonds = table.law == "nonlocal"
    law = make_bond_parameters(table, 1.0) if has_bonds else make_friction_law(table, face["load"])
    return make_law(table.law, law, face["load"], varies=varies)


def make_case(spec: dict, rtol: float = cases.DEFAULT_RTOL, n_steps: float = cases.MIN_STEPS):
    """Return the case of a spec for a relative tolerance of a step and a number of steps in a period."""
    columns = {name: np.array(spec[name]) for name in ("omega", "zeta", "base", "output", "slides")}
    slides, omega = columns["slides"], columns["omega"]
    names = tuple(map(str, range(omega.size)))
    modes = ModalBasis(
        names, omega, columns["zeta"], slides[0], columns["base"], columns["output"], spec["mass"], faces=slides
    )  # fmt: skip
    if spec["rows"]:
        signal = drives.make_record(*map(np.array, spec["rows"]), spec["period"])
    else:
        repeat = 1 if len(spec["tones"]) == 1 else 0
        signal = drives.make_tones(spec["tones"], spec["period"], repeat)

    interfaces = []
    for face, slide in zip(spec["faces"], slides):
        numbers = (face[name] for name in ("load", "amplitude", "omega", "phase", "stiffness"))
        load = cases.Load(*numbers, tuple(face["heave"]))
        interfaces.append(cases.Interface(make_interface_law(face), load, slide))

    size = spec["length"]
    options = cases.Options(spec["kind"] != "release", rtol=rtol, n_steps=n_steps)
    rig = cases.make_rig(modes, signal, interfaces, (size, size * omega[0]), options)
    window = int(max(1, min(10, spec["cycles"] // 10)))
    schedule = cases.make_schedule(spec["cycles"], spec["period"], window)
    start = cases.make_start(rig, interfaces, SimpleNamespace(z=spec["z"], v=spec["v"]))
    return cases.Case(rig, start, *schedule, np.zeros(0), len(interfaces))


def compare_with_reference(spec: dict, true: dict) -> dict:
    """Return the distance of each measure from its reference, relative to the stated error and that of the reference."""
    rtol = cases.DEFAULT_RTOL
    values = runs.run_case(make_case(spec)).values
    coarse = make_case(spec, runs.COARSE * rtol, cases.MIN_STEPS / runs.COARSE_STEP)
    errors = estimate_event_driven_errors(values, runs.run_case(coarse).values, rtol)
    sizes = {
        "relative_displacement_amplitude": spec["length"],
        "absolute_acceleration_peak": spec["acceleration"],
    }
    ratios = {}
    for name in true.keys() - {"drift_per_cycle"}:  # which runs of scenes find
        distance = abs(values[name] - true[name])
        if name == "slip_start_phase":
            distance = min(distance, abs(np.pi - distance))
        doubt = REFERENCE_ERROR * abs(true[name]) + ZERO * sizes.get(name, 1.0)
        ratios[name] = float(distance / (errors[name] + doubt))
    return ratios
