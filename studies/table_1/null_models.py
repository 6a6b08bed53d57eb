"""Power laws without mechanics as a baseline for the fitted rig.

The power laws are y = C a^p f^q for each kind of reading, with the input a and the frequency f. The
logarithm of y is linear in the unknowns, so that linear least squares give the exact solution.
Readings flagged U are used without correction, which can only favour these models.
"""

import numpy as np

from patchfem.campaigns.rows.cells import MIN_COMPARED_DISPLACEMENT, Readings

NULL_MODELS = ("constant", "power_input", "power_input_frequency")


def fit_null_model(readings: Readings, name: str, training) -> tuple:
    """Fit a power law without mechanics to selected readings, and predict all readings with it.

    The models are y = C a ("constant"), y = C a^p ("power_input") and y = C a^p f^q
    ("power_input_frequency"). An exponent that the training readings do not determine, such as q
    for a single frequency, keeps its value in the law y = C a: p = 1 or q = 0.

    Parameters
    ----------
    readings : Readings
    name : str
        One of NULL_MODELS.
    training : (n,) bool
        Mask of the fitted readings.

    Returns
    -------
    tuple
        Log ratios ln(computed/measured) (n,), NaN for a kind without training readings; and a dict
        by kind of the fitted "factor" C and the exponents of "input" and "frequency".
    """
    logs = np.full(readings.row.size, np.nan)
    numbers = {}
    inputs = np.log(readings.conditions[readings.condition])
    for kind, is_of_kind in (
        ("acceleration", readings.is_acceleration),
        ("displacement", ~readings.is_acceleration),
    ):
        fitted = is_of_kind & training
        if not fitted.any():
            continue
        minimum = 1e-300 if kind == "acceleration" else MIN_COMPARED_DISPLACEMENT
        measured = np.log(np.maximum(readings.measured, minimum))
        y = measured - inputs[:, 1]
        columns = [np.ones(len(inputs))]
        mean = inputs[fitted].mean(axis=0)
        if name != "constant":
            columns.append(inputs[:, 1] - mean[1])
        if name == "power_input_frequency":
            columns.append(inputs[:, 0] - mean[0])
        design = np.stack(columns, axis=1)
        coefficients = np.linalg.lstsq(design[fitted], y[fitted], rcond=1e-10)[0]
        input_power, frequency_power = [*coefficients[1:].tolist(), 0.0, 0.0][:2]
        computed = np.maximum(design @ coefficients + inputs[:, 1], np.log(minimum))
        logs[is_of_kind] = (computed - measured)[is_of_kind]
        offset = input_power * mean[1] + frequency_power * mean[0]
        numbers[kind] = {
            "factor": float(np.exp(coefficients[0] - offset)),
            "input": 1 + input_power,
            "frequency": frequency_power,
        }
    return logs, numbers
