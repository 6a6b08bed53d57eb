"""SUNDIALS' side of work_precision.py: runs under the interpreter that has scikit-sundae, knows nothing of patchfem.

Reads one JSON request per line (problem, its numbers, tolerance, times), answers one JSON line each.
"""

import json
import sys
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from switched import PROBLEMS, follow


def _advancer(cvode, tolerance: float, atol: float, method: str):
    """Return the function `advance` of `switched`, based on CVODE with its root finder."""

    def advance(rhs, event, t, y, end, longest, wanted):
        def slope(t, y, out):
            out[:] = rhs(t, y)

        def roots(t, y, out):
            out[0] = event(t, y)

        roots.terminal = [True]
        roots.direction = [-1]
        solver = cvode(
            slope,
            method=method,
            rtol=tolerance,
            atol=atol,
            eventsfn=roots,
            num_events=1,
            max_step=longest,
            max_num_steps=100000,
        )
        grid = (
            np.concatenate([[t], wanted]) if len(wanted) and wanted[0] > t else np.array([t, end])
        )
        if grid[-1] < end:
            grid = np.append(grid, end)
        found = solver.solve(grid, y)
        if found.status < 0:
            raise RuntimeError(found.message)
        stopped = found.t_events is not None and len(found.t_events) > 0
        last, state = (
            (found.t_events[-1], found.y_events[-1]) if stopped else (found.t[-1], found.y[-1])
        )
        which = np.isin(found.t, wanted)
        return float(last), np.array(state), found.y[which]

    return advance


def answer(cvode, ask: dict) -> dict:
    """Return the slide at the requested times, the CPU seconds and the number of events."""
    times = np.array(ask["times"])
    best = np.inf
    for _ in range(ask.get("repeats", 1)):
        problem = PROBLEMS[ask["problem"]](**ask["numbers"])
        start = process_time()
        slide, events = follow(
            problem,
            _advancer(cvode, ask["tolerance"], ask["tolerance"] * ask["scale"], ask["method"]),
            times,
            ask["longest"],
        )
        best = min(best, process_time() - start)
    return {"slide": slide.tolist(), "seconds": best, "events": events}


def main() -> None:
    """Send the version of scikit-sundae, then answer each request."""
    try:
        import sksundae
        from sksundae.cvode import CVODE
    except ImportError as error:
        print(json.dumps({"missing": str(error)}), flush=True)
        return
    print(json.dumps({"version": str(sksundae.__version__)}), flush=True)
    for line in sys.stdin:
        try:
            found = answer(CVODE, json.loads(line))
        except (RuntimeError, ValueError, ArithmeticError) as error:
            found = {"error": str(error)}
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
