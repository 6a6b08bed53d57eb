"""Self-check of the modes that an engine uses.

In: `Evidence`. Out: Findings on the modes, or on the masses and springs, of the scene.
"""

from collections.abc import Iterator

import numpy as np

from .evidence import Evidence, parse_scene_number
from .finding import ROUND_OFF_TOL, Finding


def check_modes(run: Evidence) -> Iterator[Finding]:
    """Compare the modes that an engine uses with those of the scene.

    For [[structure.mode]], frequency, damping ratio and participations of each mode are compared.
    For masses and springs, the sum of omega^2 is the trace of M^-1 K, i.e. the sum of
    stiffness/mass over the masses that each spring joins. Both comparisons hold to round-off.
    """
    rig = run.model.rig
    if rig is None:
        return
    modes = run.modes
    structure = run.scene["structure"]
    if modes is not None and modes.omega.size == rig.modes.omega.size:
        pairs = (
            ("natural frequency", rig.modes.omega / (2 * np.pi), modes.omega / (2 * np.pi), "Hz"),
            ("damping ratio", rig.modes.zeta, modes.zeta, ""),
            ("slide", rig.modes.slide, modes.slide, ""),
            ("base", rig.modes.base, modes.base, ""),
            ("output", rig.modes.output, modes.output, ""),
        )
        for name, found, expected, unit in pairs:
            for k, (mode, other) in enumerate(zip(np.asarray(found, float), expected)):
                yield Finding(
                    f"the {name} of mode {k + 1}",
                    float(mode),
                    float(other),
                    ROUND_OFF_TOL * np.abs(expected).max(initial=0.0),
                    unit,
                )
    elif (
        "masses" in structure
        and "bonded" not in structure
        and structure.get("measured", "free") == "free"
    ):
        masses = [parse_scene_number(mass) for mass in structure["masses"]]
        terms = []
        for spring in structure.get("spring", ()):
            stiffness = parse_scene_number(spring["stiffness"])
            terms += [stiffness / masses[place - 1] for place in spring["between"] if place]
        trace = sum(terms)
        found = float(np.sum(rig.modes.omega**2))
        yield Finding(
            "the sum of the squares of the natural frequencies",
            found,
            trace,
            1e-6 * trace,
            "rad2/s2",
        )
