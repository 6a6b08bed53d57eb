"""Models without mechanics that a fitted rig has to beat: y = C a^p f^q of input a and frequency f, kind by kind.

Their logarithm is linear in what is free, so each is an exact least-squares answer. Readings flagged U count as they
stand, which can only help them.
"""

import numpy as np

from .cells import FLOOR, Cells

NULLS = ("constant", "power_input", "power_input_frequency")


def predicted(cells: Cells, name: str, training) -> tuple:
    """(ln(computed/measured) (n,), {kind: {"factor", "input", "frequency"}}) of a null model fitted to the readings
    `training` (n,) bool.

    constant: y = C a; power_input: y = C a^p; power_input_frequency: y = C a^p f^q. What the training readings do not
    determine, such as q at one frequency, is the least change from C a: p stays 1, or q 0. A kind of which nothing is
    in training is NaN.
    """
    out, found = np.full(cells.row.size, np.nan), {}
    at = np.log(cells.conditions[cells.condition])
    for kind, which in (("acceleration", cells.felt), ("displacement", ~cells.felt)):
        here = which & training
        if not here.any():
            continue
        low = 0.0 if kind == "acceleration" else FLOOR
        y = np.log(np.maximum(cells.measured, low if low else 1e-300)) - at[:, 1]
        columns = [np.ones(len(at))]
        middle = at[here].mean(axis=0)
        if name != "constant":
            columns.append(at[:, 1] - middle[1])
        if name == "power_input_frequency":
            columns.append(at[:, 0] - middle[0])
        table = np.stack(columns, axis=1)
        factor = np.linalg.lstsq(table[here], y[here], rcond=1e-10)[0]
        powers = [float(x) for x in factor[1:]] + [0.0] * (3 - len(factor))
        model = table @ factor + at[:, 1]
        if low:
            model = np.maximum(model, np.log(low))
        out[which] = (model - np.log(np.maximum(cells.measured, low if low else 1e-300)))[which]
        found[kind] = {
            "factor": float(np.exp(factor[0] - powers[0] * middle[1] - powers[1] * middle[0])),
            "input": 1 + powers[0],
            "frequency": powers[1],
        }
    return out, found
