"""Models without mechanics that a fitted rig has to beat.

They are y = C a^p f^q for each kind of reading; a is the input and f the frequency. The logarithm
of y is linear in the free values, so each model is an exact linear least-squares solution. Readings
flagged U count as they are, which can only favour these models.
"""

import numpy as np

from .cells import MIN_DISPLACEMENT, Readings

NULL_MODELS = ("constant", "power_input", "power_input_frequency")


def fit_null_model(cells: Readings, name: str, training) -> tuple:
    """Fit a null model to some readings and predict all of them.

    The models are y = C a ("constant"), y = C a^p ("power_input") and y = C a^p f^q
    ("power_input_frequency"). If the training readings do not determine an exponent, such as q at a
    single frequency, it is that of the smallest change from C a: p = 1 or q = 0.

    Parameters
    ----------
    cells : Readings
    name : str
        One of NULL_MODELS.
    training : (n,) bool
        Readings of the fit.

    Returns
    -------
    tuple
        ln(computed/measured) (n,), NaN for a kind without training readings; and by kind the fitted
        "factor", exponent of "input" and exponent of "frequency".
    """
    out = np.full(cells.row.size, np.nan)
    found = {}
    at = np.log(cells.conditions[cells.condition])
    for kind, which in (("acceleration", cells.felt), ("displacement", ~cells.felt)):
        here = which & training
        if not here.any():
            continue
        low = 0.0 if kind == "acceleration" else MIN_DISPLACEMENT
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
