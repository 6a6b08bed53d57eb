"""Measured modes from a universal file: shapes of dataset 55, or frequency responses of dataset 58 to be fitted."""

import numpy as np

from ..core import PatchfemError
from ..inputs.universal import read_datasets
from . import identify
from .places import AXES, Shapes

NORMAL, COMPLEX = 2, (3, 7)  # analysis types of dataset 55
POWER = {8: 0, 11: 1, 12: 2}  # ordinate type of dataset 58 -> derivatives of displacement
FORCE = (9, 13)
FRF = 4
UNITS = {"g": 9.80665, "lbf": 4.4482216152605}


def read(path) -> Shapes:
    """Modes of a universal file, from dataset 55 where it has any, else fitted to its frequency responses (58).

    Lengths and forces are turned into SI by dataset 164 where it stands. PatchfemError names what is lacking.
    """
    sets = read_datasets(path, "structure.file: ")
    factors = next(((s["length"], s["force"]) for s in sets if s.get("type") == 164), (1.0, 1.0))
    modes = [
        s for s in sets if s.get("type") == 55 and s.get("analysis_type") in (NORMAL, *COMPLEX)
    ]
    if modes:
        return _modes(modes, factors)
    responses = [s for s in sets if s.get("type") == 58]
    if not responses:
        types = sorted({str(s.get("type", "?")) for s in sets})
        raise PatchfemError(
            f"structure.file: {path} has neither mode shapes (dataset 55, normal or complex modes) nor "
            f"frequency responses (58); its datasets: {', '.join(types) or 'none'}"
        )
    return _responses(responses, factors)


def _modes(sets, factors) -> Shapes:
    length, force = factors
    frequency, zeta, columns, notes = [], [], [], []
    for number, one in enumerate(sets, 1):
        shape = {
            (int(node), axis): one[f"r{axis + 1}"][k]
            for axis in range(6)
            if f"r{axis + 1}" in one
            for k, node in enumerate(one["node_nums"])
        }
        if one["analysis_type"] == NORMAL:
            f, d, m = one["freq"], one["modal_damp_vis"], one["modal_m"] * length / force
            if not d and one["modal_damp_his"]:
                d = one["modal_damp_his"] / 2
                notes.append(
                    f"mode {number}: half of the hysteretic damping is used as the viscous damping ratio"
                )
            values = np.array(list(shape.values()))
            if np.iscomplexobj(values):
                values, _ = _rotated(values)
        else:
            values, turn = _rotated(np.array(list(shape.values()), complex))
            eig = one["eig"]
            f, d = abs(eig) / (2 * np.pi), -eig.real / abs(eig) if eig else 0.0
            m = abs(one["modal_a"]) / max(2 * abs(eig.imag), 1e-300) * length / force
            left = np.linalg.norm(turn.imag) / max(np.linalg.norm(turn), 1e-300)
            notes.append(
                f"mode {number} is complex; the shape is rotated in phase and only its real part is used, "
                f"which leaves out {100 * left:.2g} % of the shape"
            )
            if not eig.imag:
                raise PatchfemError(
                    f"structure.file: mode {number} has the real eigenvalue {eig.real:.5g} 1/s; only "
                    "vibrating modes can be converted to real ones"
                )
        if not m > 0:
            raise PatchfemError(
                f"structure.file: mode {number} ({f:.5g} Hz) has no modal mass, so its shape has no "
                "scale; export the modal mass (dataset 55: record 8; complex modes: modal A), or "
                "frequency responses"
            )
        if d < 0 or f < 0:
            raise PatchfemError(
                f"structure.file: mode {number} has frequency {f:.5g} Hz and damping {d:.3g}; both "
                "must be >= 0"
            )
        frequency.append(f)
        zeta.append(d)
        columns.append(dict(zip(shape, values / np.sqrt(m))))
    places = dict.fromkeys(place for column in columns for place in column)
    motion = {place: np.array([column.get(place, 0.0) for column in columns]) for place in places}
    return Shapes(np.array(frequency), np.array(zeta), motion, notes)


def _rotated(values) -> tuple:
    """(real shape, shape with its phase turned): the turn that makes the sum of squares real and positive."""
    turn = values * np.exp(-0.5j * np.angle(np.sum(values**2)))
    return turn.real, turn


def _responses(sets, factors) -> Shapes:
    length, force = factors
    wrong = [s for s in sets if s["func_type"] != FRF]
    sets = [s for s in sets if s["func_type"] == FRF]
    if not sets:
        raise PatchfemError(
            "structure.file: dataset 58 contains no frequency response function (function type 4); its "
            f"types: {', '.join(sorted({str(s['func_type']) for s in wrong}))}"
        )
    notes, x, measured = [], np.asarray(sets[0]["x"], float), {}
    for one in sets:
        kind, over = one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]
        what = f"response {one['rsp_node']}:{one['rsp_dir']:+d} over {one['ref_node']}:{one['ref_dir']:+d}"
        if kind not in POWER or over not in FORCE:
            raise PatchfemError(
                f"structure.file: {what} is a response of type {kind} per input of type {over}; "
                "displacement (8), velocity (11) or acceleration (12) per force (13) is needed"
            )
        if len(one["x"]) != x.size or not np.allclose(one["x"], x, rtol=1e-6, atol=0):
            raise PatchfemError(
                f"structure.file: {what} is given at other frequencies than the first response; all "
                "responses need the same frequencies"
            )
        if not np.isfinite(one["data"]).all() or not np.iscomplexobj(one["data"]):
            raise PatchfemError(
                f"structure.file: {what} contains values that are not finite or not complex"
            )
        sign_out, place = _place(one["rsp_node"], one["rsp_dir"])
        sign_in, ref = _place(one["ref_node"], one["ref_dir"])
        unit = _unit(one["ordinate_axis_units_lab"], notes) / _unit(
            one["orddenom_axis_units_lab"], notes
        )
        scale = unit * (force / length if (force, length) != (1.0, 1.0) else 1.0)
        measured[place, ref] = (sign_out * sign_in * scale * np.asarray(one["data"]), POWER[kind])
    return identify.modes_from_responses(x, measured, notes)


def _unit(label, notes) -> float:
    label = (label or "").strip()
    known = {"", "none", "n", "m", "m/s", "m/s^2", "m/s2", "m/s**2", "mps2"}
    if label.lower() not in known and label not in UNITS:
        note = f"structure.file: the unit label '{label}' is not known; the values are taken as SI"
        notes += [note] if note not in notes else []
    return UNITS.get(label, 1.0)


def _place(node, direction) -> tuple:
    if not 1 <= abs(direction) <= len(AXES):
        raise PatchfemError(
            f"structure.file: direction {direction} of node {node} is unknown; +-1 to +-6 for x, y, z, "
            "rx, ry, rz is needed"
        )
    return (1.0 if direction > 0 else -1.0), (int(node), abs(direction) - 1)
