"""Independent program for static patches, which uses nothing of the package.

    python tests/support/patch_by_skfem.py FILE [--numbers 0:100]

Both pieces are meshed by scikit-fem with quadratic elements on graded columns and condensed by SuperLU with unit loads.
The pressure is linear between the corner nodes of the interface and tested against the mean of the gap over its hat
functions. The contact is solved by a primal-dual interior-point method. Columns are bisected towards the edges of the
contact, the ends of the interface and steps. Differences between two levels of bisection are the stated uncertainties.
Families: plain, step, overhang, linear layer, smooth trace. Measures have the names of the package.
"""

from __future__ import annotations

import argparse
import itertools
import json
import tomllib
from pathlib import Path
from time import process_time

import numpy as np
from random_patches import draw_patch
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad
from skfem.helpers import ddot, eye, sym_grad, trace

FAMILIES = ("plain", "step", "overhang", "linear layer", "smooth trace")
# Shortest columns at the contact edges over the length of the contact, growth of the columns, and smallest number of
# columns in half the interface, of both levels
LEVELS = ((1 / 30, 1.2, 12), (1 / 120, 0.9, 24))


@BilinearForm
def elasticity(u, v, w):
    """Weak form of plane elasticity."""
    strain = sym_grad(u)
    return ddot(w.lam * eye(trace(strain), 2) + 2 * w.mu * strain, sym_grad(v))


def read_number(text: str) -> float:
    """Return the number of a quantity in SI units."""
    return float(str(text).split(" ")[0])


def read_material(table: dict) -> tuple[float, float]:
    """Return Young's modulus and Poisson's ratio."""
    return read_number(table["young"]), table["poisson"]


def bisect(low, high, marks, sizes, growth, largest):
    """Return columns between two ends, bisected until they are short enough for their distance from marks."""
    inner = [mark for mark in marks if low < mark < high]
    x = np.unique([low, *inner, high])
    x = np.sort(
        np.concatenate([x, *(np.linspace(a, b, 5)[1:-1] for a, b in itertools.pairwise(x))])
    )
    while True:
        left, right = x[:-1, None], x[1:, None]
        distance = np.maximum(0, np.maximum(left - marks, marks - right))
        limit = np.minimum(largest, (sizes + growth * distance).min(axis=1))
        is_long = np.diff(x) > limit
        if not is_long.any():
            return x
        x = np.sort(np.concatenate([x, (x[:-1] + x[1:])[is_long] / 2]))


def condense(x, piece, plane, first_row, growth, face):
    """Return the compliances nn, tt, nt (m, m) of hat-weighted pressures on the columns of the face, per unit width."""
    marks, sizes = np.array([0.0, piece["height"]]), np.array([first_row, piece["height"] / 20])
    thickness = piece["thickness"]
    if thickness:
        marks, sizes = np.append(marks, thickness), np.append(sizes, max(first_row, thickness / 8))
    y = bisect(0.0, piece["height"], marks, sizes, growth, piece["height"] / 5)
    mesh = MeshQuad.init_tensor(x, y)
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=4)
    is_coating = mesh.p[1][mesh.t].mean(axis=0) < thickness
    young, nu = np.where(
        is_coating, np.array(piece["coating"])[:, None], np.array(piece["substrate"])[:, None]
    )
    mu = young / 2 / (1 + nu)
    lam = 2 * mu * nu / (1 - 2 * nu)
    if plane == "stress":
        lam = 2 * lam * mu / (lam + 2 * mu)
    ones = np.ones(basis.dx.shape)
    K = elasticity.assemble(basis, lam=lam[:, None] * ones, mu=mu[:, None] * ones).tocsc()
    free = np.flatnonzero(basis.doflocs[1] < piece["height"] * (1 - 1e-12))
    # Loads: int phi_i N_j over the edges, phi_i the hat functions of the face, N_j quadratic along an edge
    on_face = np.flatnonzero(np.abs(basis.doflocs[1]) < 1e-15)
    order = on_face[np.argsort(basis.doflocs[0][on_face], kind="stable")].reshape(-1, 2)
    order.sort(axis=1)
    m = face[1] - face[0] + 1
    loads = np.zeros((2, K.shape[0], m))
    local = np.array([[1 / 6, 1 / 3, 0], [0, 1 / 3, 1 / 6]])
    for cell in range(m - 1):
        k = 2 * (face[0] + cell)
        h = x[face[0] + cell + 1] - x[face[0] + cell]
        for component in (0, 1):
            loads[component][order[k : k + 3, component], cell : cell + 2] += h * local.T
    factor = splu(
        K[free][:, free],
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    weight = loads[0].sum(axis=0)
    u = [factor.solve(load[free]) for load in loads]
    nn, tt, nt = (
        (loads[a][free].T @ u[b]) / np.outer(weight, weight) for a, b in ((1, 1), (0, 0), (1, 0))
    )
    return nn, tt, nt


def solve_program(C, gap, rigid, target, spring):
    """Minimise f C f / 2 + gap f for f >= 0 with rigid^T f + spring q = target, by an interior-point method."""
    n, r = rigid.shape
    scale = target[0] * np.abs(C).max()
    C, gap = C * target[0] / scale, gap / scale
    S = np.diag(spring) / target[0] * scale
    goal = target / target[0]
    f, w, q = np.full(n, 1 / n), np.ones(n), np.zeros(r)
    for _ in range(120):
        mu = f @ w / n
        dual = C @ f + gap - rigid @ q - w
        primal = rigid.T @ f + S @ q - goal
        if mu < 1e-15 and abs(dual).max() < 1e-12 and abs(primal).max() < 1e-12:
            break

        def step(centre, f=f, w=w, dual=dual, primal=primal):
            """Return the Newton step towards complementarity products `centre`."""
            comp = f * w - centre
            A = np.block([[C + np.diag(w / f), -rigid], [rigid.T, S]])
            d = np.linalg.solve(A, np.r_[-dual - comp / f, -primal])
            return d[:n], -(comp + w * d[:n]) / f, d[n:]

        def largest(value, change):
            """Return the largest step that keeps values positive."""
            ratio = np.where(change < 0, -value / np.where(change < 0, change, 1.0), np.inf)
            return min(1.0, 0.9995 * ratio.min())

        df, dw, _ = step(0.0)
        after = (f + largest(f, df) * df) @ (w + largest(w, dw) * dw) / n
        df, dw, dq = step((after / mu) ** 3 * mu - df * dw)
        a = min(largest(f, df), largest(w, dw))
        f, w, q = f + a * df, w + a * dw, q + a * dq
    return f * target[0], q * scale, f > w


def solve_level(contact: dict, trace_points, finest: float, growth: float, n_columns: int) -> dict:
    """Return the measures of a scene on columns that are bisected to the given shortest ones."""
    get = {key: read_number(contact[key]) for key in ("length", "width", "height", "load")}
    plane = contact.get("plane", "strain")
    pieces = []
    for side in ("lower", "upper"):
        own = contact.get(side, {})
        coating = contact.get("coating")
        substrate = read_material(own.get("substrate", contact["substrate"]))
        pieces.append(
            {
                "length": read_number(own.get("length", get["length"])),
                "height": read_number(own.get("height", get["height"])),
                "substrate": substrate,
                "coating": read_material(coating["material"]) if coating else substrate,
                "thickness": read_number(coating["thickness"]) if coating else 0.0,
            }
        )
    half = get["length"] / 2
    tilt = read_number(contact.get("tilt", {}).get("angle", "0"))
    step = contact.get("step")
    line = contact.get("load_line")
    spring = read_number(contact.get("holder", {}).get("rotational_stiffness", "0"))
    can_rotate = line is not None or spring > 0
    singular = pieces[0]["length"] != pieces[1]["length"]
    marks = [-half, half, *([read_number(step["at"])] if step else [])]
    width, edges = 2 * half, []
    for lap in range(9):
        size = max(finest * width, 1e-7 * half) * (16 if lap < 4 else 1) if lap > 1 else half / 25
        near = np.array([*marks, *edges])
        thin = min((p["thickness"] for p in pieces if p["thickness"]), default=half)
        corner = size if singular or step else min(half / 40, thin / 6, width / 30)
        sizes = np.array([corner] * len(marks) + [size] * len(edges))
        largest = half / n_columns if trace_points is None else half / 80
        x = bisect(-half, half, near, sizes, growth, largest)
        h = np.diff(x)
        weight = (np.append(h, 0) + np.append(0, h)) / 2
        gap = tilt * x
        if "crown" in contact:
            gap = gap + x**2 / (2 * read_number(contact["crown"]["radius"]))
        if trace_points is not None:
            gap = gap + np.interp(x, *trace_points)
        if step:
            gap = gap + read_number(step["height"]) * np.heaviside(x - marks[2], 0.5)
        total = 0
        for sign, piece in ((1, pieces[0]), (-1, pieces[1])):
            beyond = (piece["length"] - get["length"]) / 2
            columns, face = x, (0, x.size - 1)
            if beyond > 1e-12:
                side = bisect(
                    half,
                    half + beyond,
                    np.array([half, half + beyond]),
                    np.array([h[-1], beyond / 8]),
                    growth,
                    beyond / 2,
                )[1:]
                other = bisect(
                    half,
                    half + beyond,
                    np.array([half, half + beyond]),
                    np.array([h[0], beyond / 8]),
                    growth,
                    beyond / 2,
                )[1:]
                columns, face = np.r_[-other[::-1], x, side], (other.size, other.size + x.size - 1)
            nn, tt, nt = condense(columns, piece, plane, h.min() * 1.5, growth, face)
            total = total + np.array([nn, tt, sign * nt]) / get["width"]
        nn, tt, nt = total
        layer = contact.get("asperities")
        if layer:
            soft = 1 / (read_number(layer["normal_stiffness"]) * weight * get["width"])
            nn = nn + np.diag(soft)
            tt = tt + np.diag(soft / layer["tangential_ratio"])
        rigid = np.stack([np.ones(x.size), x], axis=1)[:, : 1 + can_rotate]
        moment = get["load"] * read_number(line["offset"]) if line else 0.0
        target = np.array([get["load"], moment])[: 1 + can_rotate]
        force, motion, active = solve_program(
            nn, gap, rigid, target, np.array([0.0, spring])[: 1 + can_rotate]
        )
        ends = np.flatnonzero(active[1:] != active[:-1])
        new_edges = [float((x[k] + x[k + 1]) / 2) for k in ends]
        loaded = np.flatnonzero(active)
        low, high = x[max(loaded[0] - 1, 0)], x[min(loaded[-1] + 1, x.size - 1)]
        done = (
            lap > 2
            and len(new_edges) == len(edges)
            and np.ptp([width, high - low]) < finest * width
        )
        edges, width = new_edges, high - low
        if done:
            break
    rotation = -motion[1] if can_rotate else 0.0
    pressure = force / weight / get["width"]
    inside = np.ix_(loaded, loaded)
    ones = np.ones(loaded.size)
    rates = np.linalg.solve(nn[inside], np.stack([ones, x[loaded]], axis=1))
    both = np.block([[nn[inside], nt[inside]], [nt[inside].T, tt[inside]]])
    shear = np.linalg.solve(both, np.r_[0 * ones, ones])[loaded.size :].sum()
    borders = np.array(
        sorted([*edges, *([-half] if active[0] else []), *([half] if active[-1] else [])])
    ).reshape(-1, 2)
    sharp = (singular and (active[0] or active[-1])) or (
        step and np.abs(x[loaded] - marks[2]).min() < 1.5 * h.min() * 2
    )
    return {
        "contact_fraction": float(np.diff(borders).sum() / get["length"]),
        "contact_half_width": float(np.ptp(borders) / 2),
        "pressure_peak": None if sharp and not layer else float(pressure.max()),
        "approach": float(motion[0]),
        "rotation": float(tilt + rotation),
        "moment": float(force @ x),
        "pressure_centre": float(force @ x / get["load"]),
        "normal_stiffness": float(rates[:, 0].sum()),
        "tangential_stiffness": float(shear),
        "rotational_stiffness": float(x[loaded] @ rates[:, 1]),
    }


def main() -> None:
    """Write the measures of the patches of the recipe with their uncertainties."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--numbers", default="0:100")
    arguments = parser.parse_args()
    with arguments.file.open("a", encoding="utf-8") as out:
        for number in range(*map(int, arguments.numbers.split(":"))):
            patch = draw_patch(number)
            if patch.family not in FAMILIES:
                continue
            started = process_time()
            contact = tomllib.loads(patch.text)["contact"]
            row = {"n": number, "family": patch.family}
            try:
                coarse, fine = (solve_level(contact, patch.trace, *level) for level in LEVELS)
                row["measures"] = {
                    name: [
                        value,
                        None
                        if value is None or coarse[name] is None
                        else abs(value - coarse[name]),
                    ]
                    for name, value in fine.items()
                }
            except (np.linalg.LinAlgError, MemoryError) as error:
                row["failed"] = str(error)
            row["cpu"] = process_time() - started
            out.write(json.dumps(row) + "\n")
            out.flush()


if __name__ == "__main__":
    main()
