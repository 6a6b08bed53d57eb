"""The peer's side of hertz_getfem.py: runs under the interpreter that has GetFEM, knows nothing of patchfem.

Reads one JSON request per line, answers one JSON line each; lengths mm, forces N per mm of depth, pressures MPa. The
formulation is the augmented Lagrangian of GetFEM's own wheel tutorial: with the gap w after motion,

    lambda = (lambda - r w)_+  weakly on the interface,  sum lambda = N  for the unknown approach d.

`quadrature` "gauss" is GetFEM's usual integral contact; "nodal" takes the corner rule there, which makes it the same
discrete problem as patchfem's. `bodies` 1 is one piece against a rigid surface of half the gap (a mirrored pair), 2 the
pair with an interface of matching nodes. The tangent is symmetric, factorised by MUMPS in every Newton step.
"""

import json
import sys
from time import process_time

import numpy as np


class Pair:
    """GetFEM model of the pair; references to every mesh and method are kept, because the model only points at them."""

    def __init__(self, gf, ask: dict):
        x, y, (young, nu) = np.array(ask["x"]), np.array(ask["depth"]), ask["material"]
        self.gf = gf
        self.model = gf.Model("real")
        self.kept = []
        model = self.model
        both = ask["bodies"] == 2
        model.add_initialized_data("lame", young * nu / ((1 + nu) * (1 - 2 * nu)))
        model.add_initialized_data("shear", young / (2 * (1 + nu)))
        lower = self._body("u", x, -y[::-1], 1)
        space = gf.MeshFem(lower, 1)
        space.set_classical_fem(1)
        model.add_filtered_fem_variable("p", space, 1)
        model.add_variable("d", 1)
        for name in ("N", "crown", "tilt"):
            model.add_initialized_data(name, 0.0)
        model.add_initialized_data("length", x[-1] - x[0])
        model.add_initialized_data("r", ask["augmentation"])
        corner = gf.MeshIm(
            lower, gf.Integ("IM_NC_PARALLELEPIPED(2,1)") if ask["quadrature"] == "nodal" else 4
        )
        self.kept += [space, corner]
        share, motion, test = ("1", "-u(2)", "Test_u(2)") if both else ("0.5", "-u(2)", "Test_u(2)")
        if both:
            upper = self._body("v", x, y, -1)
            model.add_interpolate_transformation_from_expression("across", lower, upper, "X")
            motion += "+Interpolate(v,across)(2)"
            test += "-Interpolate(Test_v,across)(2)"
        gap = f"{share}*(crown*X(1)*X(1)/2+tilt*X(1))-d{motion}"
        model.add_nonlinear_term(
            corner,
            f"pos_part(p-r*({gap}))*({test}+Test_d)-N/length*Test_d"
            f"+(pos_part(p-r*({gap}))-p)/r*Test_p",
            1,
            1,
        )
        nodes = space.basic_dof_nodes()
        self.x = np.sort(nodes[0, np.abs(nodes[1]) < 1e-9])
        self.order = np.argsort(nodes[0, np.abs(nodes[1]) < 1e-9])

    def _body(self, name, x, y, outward):
        gf = self.gf
        mesh = self.gf.Mesh("cartesian Q1", x, y)
        mesh.set_region(1, mesh.outer_faces_with_direction([0, outward], 0.01))
        mesh.set_region(2, mesh.outer_faces_with_direction([0, -outward], 0.01))
        space = gf.MeshFem(mesh, 2)
        rule = gf.MeshIm(mesh, 3)
        space.set_classical_fem(1)
        self.model.add_fem_variable(name, space)
        self.model.add_isotropic_linearized_elasticity_brick(rule, name, "lame", "shear")
        self.model.add_Dirichlet_condition_with_simplification(name, 2)
        self.kept += [mesh, space, rule]
        return mesh

    def solve(self, step: dict, limit: float) -> int:
        """Solve by Newton's method from the present state under step = {N, crown, tilt}; return the number of iterations."""
        for name, value in step.items():
            self.model.set_variable(name, [value])
        count, converged = self.model.solve("max_res", limit, "max_iter", 60, "lsolver", "mumps")
        if not converged:
            raise ArithmeticError(f"Newton did not converge in {count} iterations")
        return int(count)


def answer(gf, ask: dict) -> dict:
    """Assemble and solve, then solve the further steps.

    Return the CPU seconds of each, and the pressures of the first and the last.
    """
    start = process_time()
    pair = Pair(gf, ask)
    pair.model.set_variable("d", [ask["start"]])
    built = process_time()
    newton = [pair.solve(ask["steps"][0], ask["limit"])]
    cold = process_time()
    out = {
        "dofs": pair.model.nbdof(),
        "build": built - start,
        "solve": cold - built,
        "x": pair.x.tolist(),
        "pressure": [pair.model.variable("p")[pair.order].tolist()],
        "warm": [],
    }
    for step in ask["steps"][1:]:
        before = process_time()
        newton.append(pair.solve(step, ask["limit"]))
        out["warm"].append(process_time() - before)
        out["pressure"].append(pair.model.variable("p")[pair.order].tolist())
    return out | {"newton": newton}


def main() -> None:
    """Send the version of GetFEM, then answer each request."""
    try:
        import getfem as gf
    except ImportError as error:
        print(json.dumps({"missing": str(error)}), flush=True)
        return
    gf.util_trace_level(0)
    gf.util_warning_level(0)
    out = sys.stdout
    sys.stdout = sys.stderr  # messages of the library must not mix with the answer
    print(json.dumps({"version": version(gf)}), file=out, flush=True)
    for line in sys.stdin:
        try:
            found = answer(gf, json.loads(line))
        except (RuntimeError, ArithmeticError) as error:
            found = {"error": str(error)}
        print(json.dumps(found), file=out, flush=True)


def version(gf) -> str:
    """Return the version of the installed library."""
    known = getattr(gf, "__version__", None)
    if known:
        return str(known)
    from subprocess import run

    found = run(
        ["dpkg-query", "-W", "-f", "${Version}", "python3-getfem"], capture_output=True, text=True
    )
    return found.stdout or "unknown"


if __name__ == "__main__":
    main()
