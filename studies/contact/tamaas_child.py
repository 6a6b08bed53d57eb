"""The side of Tamaas in rough_split.py: runs under the interpreter that has Tamaas, knows nothing of patchfem.

Reads one JSON request per line, answers one JSON line each; SI units. Periodic heights are pressed on a half plane under
two mean pressures; the answer has the contact fraction and the peak pressure at the first one, and the stiffness of
the interface, i.e. the change of pressure over that of the distance of the mean planes.
"""

import json
import sys

import numpy as np

TOLERANCE = 1e-8  # residual below which a solution is accepted
PRESSURE_STEP = 0.02  # relative change of the mean pressure for the stiffness


def _press(tm, ask: dict, pressure: float) -> tuple:
    """Return the tractions (n,) [Pa] and the distance [m] of the mean planes."""
    heights = np.array(ask["heights"])
    model = tm.Model(tm.model_type.basic_1d, [ask["length"]], [heights.size])
    model.E, model.nu = ask["material"]
    solver = tm.PolonskyKeerRey(model, heights, TOLERANCE)
    solver.max_iter = 100000
    residual = solver.solve(pressure)
    if not residual <= TOLERANCE:
        raise ArithmeticError(f"the residual {residual:.1e} stays above {TOLERANCE:.0e}")
    traction = np.array(model.traction).ravel()
    gap = np.array(model.displacement).ravel() - heights
    return traction, float(gap.mean() - gap.min())


def answer(tm, ask: dict) -> dict:
    """Return contact fraction, peak pressure and stiffness of the interface."""
    traction, distance = _press(tm, ask, ask["pressure"])
    _, closer = _press(tm, ask, (1 + PRESSURE_STEP) * ask["pressure"])
    return {
        "fraction": float((traction > 0).mean()),
        "peak": float(traction.max()),
        "stiffness": PRESSURE_STEP * ask["pressure"] / (distance - closer),
    }


def main() -> None:
    """Say which Tamaas this is, then answer request by request."""
    try:
        import tamaas as tm
    except ImportError as error:
        print(json.dumps({"missing": str(error)}), flush=True)
        return
    tm.set_log_level(tm.LogLevel.error)
    print(json.dumps({"version": str(tm.__version__)}), flush=True)
    for line in sys.stdin:
        try:
            found = answer(tm, json.loads(line))
        except (RuntimeError, ArithmeticError) as error:
            found = {"error": str(error)}
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
