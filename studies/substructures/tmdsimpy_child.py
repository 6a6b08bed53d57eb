"""The peer's side of readers.py: runs under the interpreter that has TMDSimPy, knows nothing of patchfem.

Reads one JSON request per line, answers one JSON line each. The request names a .npz of M, C, K, Fex1, Omega, output
and friction elements; the answer is half the peak-to-peak of the output [m] in a balance of odd harmonics.
"""

import json
import sys

import numpy as np


def answer(ask: dict) -> dict:
    """Balance with the library's own elements and solver, started from the motion of the elements held."""
    from tmdsimpy.nlforces.vector_jenkins import VectorJenkins
    from tmdsimpy.solvers import NonlinearSolver
    from tmdsimpy.vibration_system import VibrationSystem

    with np.load(ask["file"]) as file:
        data = {name: file[name] for name in file.files}
    M, C, K, omega = data["M"], data["C"], data["K"], float(data["Omega"])
    system = VibrationSystem(M, K, C)
    held = K.copy()
    for row, stiffness, limit in zip(data["direction"], data["stiffness"], data["limit"]):
        system.add_nl_force(VectorJenkins(row[None], row[:, None], float(stiffness), float(limit)))
        held += stiffness * np.outer(row, row)
    n, harmonics = len(M), np.arange(1, ask["harmonics"] + 1, 2)
    load = np.zeros((2 * harmonics.size, n))
    load[0] = data["Fex1"]
    start = np.zeros_like(load)
    first = np.linalg.solve(held + 1j * omega * C - omega**2 * M, data["Fex1"])
    start[0], start[1] = first.real, -first.imag
    size = np.abs(start).max()

    def residual(x):
        rest, slope, _ = system.hbm_res(np.append(x * size, omega), load.ravel(), harmonics, ask["samples"])
        return rest, slope * size

    found, rest, *_ = NonlinearSolver().nsolve(residual, start.ravel() / size, verbose=False, xtol=1e-12)
    moved = found.reshape(-1, n) * size @ data["output"]
    angle = np.outer(harmonics, np.linspace(0, 2 * np.pi, 4001))
    wave = moved[0::2] @ np.cos(angle) + moved[1::2] @ np.sin(angle)
    return {"amplitude": float(np.ptp(wave)) / 2, "rest": float(np.abs(rest).max() / np.abs(load).max())}


def main() -> None:
    """Say which TMDSimPy this is, then answer request by request."""
    out, sys.stdout = sys.stdout, sys.stderr  # the library may print
    try:
        import tmdsimpy
    except ImportError as error:
        print(json.dumps({"missing": str(error)}), file=out, flush=True)
        return
    print(json.dumps({"version": getattr(tmdsimpy, "__version__", "unknown")}), file=out, flush=True)
    for line in sys.stdin:
        try:
            found = answer(json.loads(line))
        except (ValueError, ArithmeticError, KeyError) as error:
            found = {"error": str(error)}
        print(json.dumps(found), file=out, flush=True)


if __name__ == "__main__":
    main()
