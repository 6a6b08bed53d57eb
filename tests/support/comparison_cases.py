"""Structures and plain twins for the tests of the comparison methods."""

import numpy as np
from report_methods.point_laws import Coulomb, Smooth
from scipy.linalg import expm
from scipy.optimize import root

from patchfem.core import DriveSegment, ModalBasis, SineDrive
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.friction.laws.tanh import Rate
from patchfem.structure.drives import Piecewise


def basis(omega, zeta, faces, base, damping=None, mass=1.0) -> ModalBasis:
    """ModalBasis of plain lists; the first interface is the output."""
    omega, faces = np.array(omega, float), np.array(faces, float).reshape(-1, len(omega))
    first = faces[0] if len(faces) else np.ones(omega.size)
    return ModalBasis(
        tuple(f"mode {i}" for i in range(omega.size)),
        omega,
        np.array(zeta, float),
        first,
        np.array(base, float),
        first,
        mass,
        damping,
        faces,
    )


S = np.sqrt(0.5)
FREE_FREE = basis([0.0, np.sqrt(2.0)], [0.0, 0.0], [[S, -S]], [-S, -S])  # Fig 16, m = k = P0 = 1
SDOF = basis([1.0], [0.003], [[1.0]], [1.0])  # P2
PLAIN = basis([1.0], [0.0], [[1.0]], [1.0])  # P1
UNIT = SineDrive(1.0, 1.0)
COUPLED = basis(
    [0.0, 1.3, 3.1],
    [0.0, 0.02, 0.01],
    [[0.7, -0.4, 0.3], [0.2, 0.6, -0.5]],
    [0.4, -0.8, 0.3],
    np.array([[0.02, 0.01, 0.0], [0.01, 0.05, -0.015], [0.0, -0.015, 0.07]]),
    1.7,
)
THREE = basis(
    COUPLED.omega,
    COUPLED.zeta,
    [*COUPLED.interfaces, [-0.3, 0.5, 0.4]],
    COUPLED.base,
    COUPLED.damping,
    1.7,
)


def sine(omega, step=None) -> Piecewise:
    """P0 sin(omega t) on unit masses; `step`: its period counts as 1000 such steps."""
    return Piecewise(
        (DriveSegment(0.0, 0.0, 1.0, omega),),
        2 * np.pi / omega if step is None else 1000 * step,
        False,
    )


def free_motion(modes, drive: SineDrive, times) -> tuple:
    """Exact (z, v) (k, n) without friction from rest under a sine."""
    n = modes.omega.size
    a = np.zeros((2 * n + 2, 2 * n + 2))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n], a[n : 2 * n, n : 2 * n] = -np.diag(modes.omega**2), -modes.damping_matrix
    a[n : 2 * n, -2] = -modes.base * drive.acceleration
    a[-2, -1], a[-1, -2] = drive.omega, -drive.omega
    begin = np.append(np.zeros(2 * n + 1), 1.0)
    states = np.array([expm(a * t) @ begin for t in times])
    return states[:, :n], states[:, n : 2 * n]


def tanh(limit, speed):
    """limit tanh(v/speed)."""
    return Smooth(Rate(limit, speed).element(1.0))


def elastic_plastic(limit, length, printed=False):
    """A spring limit/length that slips at the limit."""
    return Smooth(ElasticPlastic(limit, length).element(1.0), printed)


def numbers(laws) -> list:
    """(kind, limit, second number, third number) of every law for the twins: Coulomb 0, tanh 1, elastic-plastic 2."""
    out = []
    for law in laws:
        if isinstance(law, Coulomb):
            out.append((0, law.static, law.kinetic, law.stick_speed))
        elif law.element.form == "speed":
            out.append((1, law.limit, 1 / law.element.numbers[2], 0.0))
        else:
            out.append((2, law.limit, law.element.length, law.printed))
    return out


def law_force(law, speed, travel, before, hold):
    """Force of a row of `numbers`."""
    kind, limit, second, third = law
    if kind == 0:
        return np.clip(hold, -limit, limit) if abs(speed) < third else second * np.sign(speed)
    if kind == 1:
        return limit * np.tanh(speed / second)
    return (
        before
        if third and abs(before) >= limit
        else np.clip(before + limit / second * travel, -limit, limit)
    )


def acceleration(modes, drive, z, v, force):
    """Modal accelerations (n,)."""
    return (
        -modes.base * drive
        - modes.omega**2 * z
        - modes.damping_matrix @ v
        - modes.interfaces.T @ force / modes.mass
    )


def holds(modes, drive, z, v, force):
    """Force (i,) that would leave each interface no acceleration, the others as they are."""
    faces = modes.interfaces
    along = faces @ acceleration(modes, drive, z, v, force)
    return force + along * modes.mass / np.sum(faces**2, axis=1)


def euler_twin(modes, drive, laws, h):
    """Explicit Euler, one interface after the other."""
    faces, count = modes.interfaces, drive.size
    z, v, f = (
        np.zeros((count, modes.omega.size)),
        np.zeros((count, modes.omega.size)),
        np.zeros((len(laws), count)),
    )
    now = np.zeros(len(laws))
    for k in range(count):
        for c, law in enumerate(laws):
            travel = faces[c] @ (z[k] - z[k - 1]) if k else 0.0
            now[c] = law_force(
                law, faces[c] @ v[k], travel, now[c], holds(modes, drive[k], z[k], v[k], now)[c]
            )
        f[:, k] = now
        if k + 1 < count:
            z[k + 1], v[k + 1] = (
                z[k] + h * v[k],
                v[k] + h * acceleration(modes, drive[k], z[k], v[k], now),
            )
    return z, v, f


def duhamel_twin(modes, drive, laws, h, force, tolerance, relax, most):
    """Fixed point on the force; one exponential of the whole state, its coupled dampers as straight forces."""
    faces, n, count = modes.interfaces, modes.omega.size, drive.size
    own = np.diag(np.diag(modes.damping_matrix))
    off = modes.damping_matrix - own
    a = np.zeros((4 * n, 4 * n))
    a[:n, n : 2 * n], a[n : 2 * n, :n], a[n : 2 * n, n : 2 * n] = (
        np.eye(n),
        -np.diag(modes.omega**2),
        -own,
    )
    a[n : 2 * n, 2 * n : 3 * n], a[2 * n : 3 * n, 3 * n :] = np.eye(n), np.eye(n)
    step = expm(a * h)[: 2 * n]
    z, v, f = np.zeros((count, n)), np.zeros((count, n)), np.zeros((len(laws), count))
    f[:, 0] = force
    for k in range(count - 1):
        trial, first = (
            f[:, k].copy(),
            -modes.base * drive[k] - off @ v[k] - faces.T @ f[:, k] / modes.mass,
        )
        for number in range(most):
            state = np.concatenate([z[k], v[k]])
            end = -modes.base * drive[k + 1] - faces.T @ trial / modes.mass
            new = state
            for _ in range(60):  # the coupled dampers at the end of the step
                last = end - off @ new[n:]
                new = step @ np.concatenate([state, first, (last - first) / h])
            q, w = faces @ (new[:n] - z[k]), faces @ new[n:]
            held = [
                holds(modes, drive[k + 1], new[:n], new[n:], trial)[c] for c in range(len(laws))
            ]
            wanted = np.array(
                [law_force(law, w[c], q[c], f[c, k], held[c]) for c, law in enumerate(laws)]
            )
            if np.abs(wanted - trial).max() <= tolerance or number == most - 1:
                break
            trial = trial + relax * (wanted - trial)
        z[k + 1], v[k + 1], f[:, k + 1] = new[:n], new[n:], trial
    return z, v, f


def newmark_twin(modes, drive, laws, h, count):
    """Average acceleration; every step one root of all interface forces at once, stuck ones by a linear solve."""
    faces, n, m, mass = modes.interfaces, modes.omega.size, len(laws), modes.mass
    cross = faces @ faces.T / mass
    inverse = np.linalg.inv(
        np.eye(n) + h / 2 * modes.damping_matrix + h * h / 4 * np.diag(modes.omega**2)
    )
    z, v, f = np.zeros((count, n)), np.zeros((count, n)), np.zeros((m, count))
    stuck = np.array([law[0] == 0 and 0 < law[3] for law in laws])
    a, now = _stopped(
        modes, acceleration(modes, drive[0], z[0], v[0], np.zeros(m)), np.zeros(m), stuck, cross
    )
    for k in range(count - 1):
        way = np.sign(faces @ v[k])

        def end(force, k=k, a=a):
            lead = v[k] + h / 2 * a
            new = inverse @ (
                -modes.base * drive[k + 1]
                - modes.omega**2 * (z[k] + h * (v[k] + h / 4 * a))
                - modes.damping_matrix @ lead
                - faces.T @ force / mass
            )
            return new, lead + h / 2 * new, z[k] + h * v[k] + h * h / 4 * (a + new)

        while True:

            def miss(force, k=k, way=way, stuck=stuck, end=end):
                _, speed, place = end(force)
                q, w = faces @ (place - z[k]), faces @ speed
                out = []
                for c, law in enumerate(laws):
                    goal = (
                        law[2] * way[c] if law[0] == 0 else law_force(law, w[c], q[c], f[c, k], 0.0)
                    )
                    out.append(w[c] * 1e3 if stuck[c] else force[c] - goal)
                return np.array(out)

            found = root(miss, f[:, k], tol=1e-13).x
            over = stuck & (np.abs(found) > [law[1] for law in laws])
            if not over.any():
                break
            way[over], stuck = np.sign(found[over]), stuck & ~over
        a, v[k + 1], z[k + 1] = end(found)
        w, now = faces @ v[k + 1], found
        stuck = stuck | np.array([law[0] == 0 and abs(w[c]) < law[3] for c, law in enumerate(laws)])
        if stuck.any():
            inner = cross[np.ix_(stuck, stuck)]
            v[k + 1] -= faces[stuck].T @ np.linalg.solve(inner, faces[stuck] @ v[k + 1]) / mass
            a, now = _stopped(modes, a, found, stuck, cross)
        f[:, k + 1] = np.clip(now, [-law[1] for law in laws], [law[1] for law in laws])
    return z, v, f


def _stopped(modes, a, force, stuck, cross):
    """Accelerations and forces with no acceleration at the stuck interfaces."""
    if not stuck.any():
        return a, force
    faces = modes.interfaces[stuck]
    more = np.linalg.solve(cross[np.ix_(stuck, stuck)], faces @ a)
    out = force.copy()
    out[stuck] += more
    return a - faces.T @ more / modes.mass, out
