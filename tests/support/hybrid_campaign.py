"""Random rigs of `hybrid` against the independent integrator; campaign `hybrid-rigs` of `campaigns`.

The group of a line names the laws and the kind of drive of the rig.
"""

from time import process_time

from campaigns import Row
from hybrid_reference import integrate
from hybrid_rigs import draw_spec, make_case

from patchfem.hybrid import runs
from patchfem.hybrid.records import Setting, Status

REFERENCE_ERROR = 2e-5  # of peaks and times of stick between the samples of the reference, relative
ZERO = 1e-12  # relative to the values that the drive alone would give


def find_errors(case, values: dict) -> dict:
    """Return the errors of the measures of a case, from a run with larger steps."""
    rough = runs.run_case(runs.with_larger_steps(case)).values
    return runs.estimate_errors(values, rough, float(case.rig.settings[Setting.RTOL]))


def compare_rig(seed: int, folder, earlier) -> dict:
    """Compare the rig of a seed with the independent integrator; see `campaigns`."""
    spec = draw_spec(seed)
    begin = process_time()
    case = make_case(spec)
    motion = runs.run_case(case)
    errors = find_errors(case, motion.values)
    line = {
        "seconds": process_time() - begin,
        "engine": "hybrid",
        "group": [*sorted({face["keys"]["law"] for face in spec["faces"]}), spec["kind"]],
    }
    if motion.status is not Status.DONE:
        return line | {"rows": [], "refused": motion.message}
    sizes = {
        "relative_displacement_amplitude": spec["length"],
        "absolute_acceleration_peak": spec["acceleration"],
    }
    rows = []
    for name, truth in integrate(spec, 1e-9, 20).items():
        doubt = REFERENCE_ERROR * abs(truth) + ZERO * sizes.get(name, 1.0)
        rows.append(Row(name, motion.values[name], errors[name], 0.0, float(truth), doubt))
    return line | {"rows": rows}
