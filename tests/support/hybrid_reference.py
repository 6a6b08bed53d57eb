"""Independent integrator of the specs of `hybrid_rigs`, which shares nothing with the package.

SciPy's DOP853 in Python between events; a step is at most 1/40 of the shortest period, and the event functions are evaluated
at LOOKS points of every step. Laws are formulated differently from the engine: elements with a stretch each, sums over the
list of dominant extremes, resting interfaces by least squares.
"""

from itertools import pairwise

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

LOOKS = 4
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(6)
ZERO = 1e-12  # event functions above minus this are positive
EDGE = 1e-13  # fraction of a step behind an event at which the next search begins


class Coulomb:
    """Rigid friction with static and kinetic coefficient; `side` is 0 at rest."""

    n_states = 0

    def __init__(self, keys, load):
        self.static = keys["static"]
        self.kinetic = self.static if keys["kinetic"] is None else keys["kinetic"]
        self.side = 0.0
        self.open = False

    def start(self):
        return []

    def rates(self, q, v, load, load_rate, s):
        return (0.0 if self.open else self.side * self.kinetic * load), v, []

    def events(self, q, v, load, load_rate, s, held):
        if self.open:
            return [-load]
        if self.side == 0:
            return [load, self.static * load - held, self.static * load + held]
        return [load, self.side * v]

    def switch(self, number, q, v, load, s, held):
        if number == 0:
            self.open = not self.open
            self.side = 1.0 if v > 0 else -1.0
        elif self.side == 0:
            self.side = 1.0 if number == 1 else -1.0
        else:
            self.side = 0.0


class Tanh:
    """Rate law."""

    n_states = 0

    def __init__(self, keys, load):
        self.mu, self.speed = keys["static"], keys["reference_speed"]
        self.open = False

    def start(self):
        return []

    def rates(self, q, v, load, load_rate, s):
        return (0.0 if self.open else self.mu * load * np.tanh(v / self.speed)), v, []

    def events(self, q, v, load, load_rate, s, held):
        return [-load if self.open else load]

    def switch(self, number, q, v, load, s, held):
        self.open = not self.open


class Elements:
    """Parallel springs with sliders, each with its own stretch."""

    def __init__(self, stiffness, limits):
        self.k, self.w = np.asarray(stiffness, float), np.asarray(limits, float)
        self.n_states = self.k.size
        self.slips = np.zeros(self.k.size)

    def start(self):
        return [0.0] * self.k.size

    def rates(self, q, v, load, load_rate, s):
        moves = self.slips == 0
        limits = self.k * self.w
        return float(self.k @ s), v * float(limits @ ~moves) / limits.sum(), np.where(moves, v, 0.0)

    def events(self, q, v, load, load_rate, s, held):
        stick = np.minimum(1 - s / self.w, 1 + s / self.w)
        return list(np.where(self.slips == 0, stick, self.slips * v))

    def switch(self, number, q, v, load, s, held):
        if self.slips[number] == 0:
            self.slips[number] = np.sign(s[number])
            s[number] = self.slips[number] * self.w[number]
        else:
            self.slips[number] = 0.0


class Iwan:
    """Segalman's law as a sum over the list of dominant extremes."""

    n_states = 0

    def __init__(self, keys, load):
        limit = keys["static"] * load
        self.chi, self.beta, self.limit = keys["chi"], keys["beta"], limit
        self.phi = (
            limit
            * (1 + self.beta)
            / (keys["stiffness"] * (self.beta + (self.chi + 1) / (self.chi + 2)))
        )
        self.extremes = []
        self.side = 0.0
        self.full = False

    def start(self):
        return []

    def first_loading(self, x):
        """Return force and slipping force of first loading to x >= 0, by the distribution of the sliders."""
        x = min(max(x / self.phi, 0.0), 1.0)
        if x >= 1.0:
            return self.limit, self.limit
        R = self.limit / (1 / (self.chi + 2) + self.beta / (self.chi + 1))
        slipping = R * x ** (self.chi + 2) / (self.chi + 2)
        sticking = R * x * ((1 - x ** (self.chi + 1)) / (self.chi + 1) + self.beta / (self.chi + 1))
        return slipping + sticking, slipping

    origin = 0.0

    def rates(self, q, v, load, load_rate, s):
        q = q - self.origin
        if not self.extremes:
            force, slipping = self.first_loading(abs(q))
            return np.sign(q) * force, slipping / self.limit * v, []
        total = np.sign(self.extremes[0]) * self.first_loading(abs(self.extremes[0]))[0]
        for a, b in zip(self.extremes, [*self.extremes[1:], q]):
            force, slipping = self.first_loading(abs(b - a) / 2)
            total += 2 * np.sign(b - a) * force
        return total, slipping / self.limit * v, []

    def events(self, q, v, load, load_rate, s, held):
        q = q - self.origin
        out = [self.side * v / self.scale]
        last = self.extremes[-1] if self.extremes else 0.0
        reach = self.phi if not self.extremes else 2 * self.phi
        out.append(np.inf if self.full else 1 - abs(q - last) / reach)
        if len(self.extremes) >= 2:
            end = self.extremes[-2]
        elif self.extremes:
            end = -self.extremes[0]
        else:
            return out
        return [*out, self.side * (end - q) / self.phi]

    scale = 1.0

    def switch(self, number, q, v, load, s, held):
        q = q - self.origin
        if number == 1:
            self.full = True
            return
        self.full = False
        if number == 0:
            self.extremes.append(q)
            self.side = -self.side
        else:
            del self.extremes[-2:]
            last = self.extremes[-1] if self.extremes else 0.0
            reach = self.phi if not self.extremes else 2 * self.phi
            self.full = abs(q - last) >= reach


class BoucWen:
    """Bouc-Wen law; `side` is the sign of the velocity."""

    n_states = 1

    def __init__(self, keys, load):
        self.mu, self.n, self.s = keys["static"], keys["exponent"], keys["shape"]
        self.length = self.mu * load / keys["stiffness"]
        self.side = 0.0

    def start(self):
        return [0.0]

    def rates(self, q, v, load, load_rate, s):
        slip = v * abs(s[0]) ** self.n * (self.s * np.sign(s[0]) * self.side + 1 - self.s)
        return self.mu * load * s[0], slip, [(v - slip) / self.length]

    def events(self, q, v, load, load_rate, s, held):
        return [self.side * v]

    def switch(self, number, q, v, load, s, held):
        self.side = -self.side


class LuGre:
    """LuGre law."""

    n_states = 1

    def __init__(self, keys, load):
        self.load = load
        self.s, self.k = keys["static"], keys["kinetic"]
        self.c, self.vs = keys["stiffness"], keys["stribeck_speed"]
        self.b, self.d = keys["micro_damping"], keys["viscous"]
        self.side = 0.0

    def start(self):
        return [0.0]

    def rates(self, q, v, load, load_rate, s):
        g = load * (self.k + (self.s - self.k) * np.exp(-((v / self.vs) ** 2)))
        slip = self.c * self.side * v * s[0] / g
        return self.c * s[0] + self.b * (v - slip) + self.d * v, slip, [v - slip]

    def events(self, q, v, load, load_rate, s, held):
        return [self.side * v]

    def switch(self, number, q, v, load, s, held):
        self.side = -self.side


class Bonds:
    """Bonds by density, sum of stretches and bond length, under the whole load."""

    n_states = 3

    def __init__(self, keys, load):
        self.keys, self.load = keys, load
        self.side = 0.0
        self.fast = False

    def start(self):
        return [self.keys["initial_bonds"] * self.load, 0.0, self.keys["bond_length"]]

    def rates(self, q, v, load, load_rate, s):
        k = self.keys
        m, z, eps = s
        speed = self.side * v
        growth = 0.0
        if k["rest_growth"] is not None:
            growth = (
                k["rest_growth"]
                / (speed if self.fast else k["rest_speed"])
                * (k["bond_length"] - eps)
            )
            growth += (
                speed / k["slip_growth"] * (k["kinetic"] / k["static"] * k["bond_length"] - eps)
            )
        force = k["static"] * z / k["bond_length"]
        slip = load * speed * z / (eps * m * m) if m > 1e-30 else 0.0
        return force, slip, [speed * (load - m) / eps, m * v - speed * z / eps, growth]

    def events(self, q, v, load, load_rate, s, held):
        out = [self.side * v]
        if self.keys["rest_growth"] is not None:
            gap = self.side * v - self.keys["rest_speed"]
            out.append(gap if self.fast else -gap)
        return out

    def switch(self, number, q, v, load, s, held):
        if number == 0:
            self.side = -self.side
        else:
            self.fast = not self.fast


class PressedSprings:
    """Elastic-plastic springs of a density that comes with the load; states: force over mu, density."""

    n_states = 2

    def __init__(self, keys, load, start):
        self.mu = keys["static"]
        self.length = self.mu * load / keys["stiffness"]
        self.first = max(start, 0.0)
        self.size = load
        self.slip = 0.0
        self.grows = True
        self.open = start < 0

    def start(self):
        return [0.0, self.first]

    def rates(self, q, v, load, load_rate, s):
        if self.open:
            return 0.0, v, [0.0, 0.0]
        gained = load_rate if self.grows else 0.0
        if self.slip == 0:
            return self.mu * s[0], 0.0, [s[1] * v / self.length, gained]
        stretch = self.slip * max(load_rate, 0.0) * self.length / s[1] if s[1] > 0 else 0.0
        slid = v - stretch
        broken = max(s[1] - load, 0.0) * max(self.slip * slid, 0.0) / self.length
        return self.mu * self.slip * load, slid, [self.slip * load_rate, gained - broken]

    def events(self, q, v, load, load_rate, s, held):
        if self.open:
            return [-load]
        size, rate = self.size, 1e3 * self.size
        growth = load_rate / rate if self.grows else (s[1] - load) / size
        if self.slip == 0:
            return [load / size, growth, (load - abs(s[0])) / size]
        return [load / size, growth, (self.slip * s[1] * v / self.length - load_rate) / rate]

    def switch(self, number, q, v, load, s, held):
        if number == 0:
            self.open = not self.open
            s[:] = 0.0
            self.slip, self.grows = 0.0, True
        elif number == 1:
            self.grows = not self.grows
            s[1] = load
        elif self.slip == 0:
            self.slip = np.sign(s[0])
        else:
            s[0] = self.slip * load
            self.slip = 0.0


def make_law(face: dict):
    """Return the law of an interface."""
    keys, load = face["keys"], face["load"]
    varies = face["amplitude"] != 0 or face["stiffness"] != 0
    if keys["law"] == "elastic-plastic" and varies:
        return PressedSprings(keys, load, load + face["amplitude"] * np.cos(face["phase"]))
    if keys["law"] == "elastic-plastic":
        return Elements([keys["stiffness"]], [keys["static"] * load / keys["stiffness"]])
    if keys["law"] == "jenkins":
        return Elements(*keys["elements"])
    table = {
        "coulomb": Coulomb,
        "tanh": Tanh,
        "iwan": Iwan,
        "bouc-wen": BoucWen,
        "lugre": LuGre,
        "nonlocal": Bonds,
    }
    return table[keys["law"]](keys, load)


class Reference:
    """Integration of a spec.

    Parameters
    ----------
    spec : dict
    rtol : float
    steps : int
        Smallest number of steps per shortest period.
    """

    def __init__(self, spec: dict, rtol: float = 1e-10, steps: int = 40):
        self.spec, self.rtol = spec, rtol
        self.n = spec["omega"].size
        self.laws = [make_law(face) for face in spec["faces"]]
        self.slices = []
        first = 2 * self.n
        for law in self.laws:
            self.slices.append(slice(first, first + law.n_states))
            first += law.n_states
        self.size = first + 2 * len(self.laws)
        fastest = [
            2 * np.pi / spec["period"],
            *(tone[1] for tone in spec["tones"]),
            *(face["omega"] for face in spec["faces"]),
        ]
        self.longest = 2 * np.pi / max(fastest) / steps
        self.n_events = 0

    def drive(self, t):
        """Return the drive acceleration."""
        if self.spec["rows"] is not None:
            return float(np.interp(t, *self.spec["rows"], right=0.0))
        return sum(a * np.sin(w * t + p) for a, w, p in self.spec["tones"])

    def load(self, face, t, y):
        """Return load and load rate, negative as if the surfaces pulled."""
        phase = face["omega"] * t + face["phase"]
        load = (
            face["load"]
            + face["amplitude"] * np.cos(phase)
            - face["stiffness"] * face["heave"] @ y[: self.n]
        )
        rate = (
            -face["amplitude"] * face["omega"] * np.sin(phase)
            - face["stiffness"] * face["heave"] @ y[self.n : 2 * self.n]
        )
        return load, rate

    def evaluate(self, t, y):
        """Return the rates, and force, slip rate, load and load rate of every interface."""
        spec, n = self.spec, self.n
        z, v = y[:n], y[n : 2 * n]
        out = np.zeros(self.size)
        a = (
            -spec["base"] * self.drive(t)
            - spec["omega"] ** 2 * z
            - 2 * spec["zeta"] * spec["omega"] * v
        )
        info = []
        resting = []
        for i, (law, face) in enumerate(zip(self.laws, spec["faces"])):
            load, load_rate = self.load(face, t, y)
            if face["stiffness"]:
                present = (
                    max(load, 0.0)
                    - face["load"]
                    - face["amplitude"] * np.cos(face["omega"] * t + face["phase"])
                )
                a = a + face["heave"] * present / spec["mass"]
            slide, speed = spec["slides"][i] @ z, spec["slides"][i] @ v
            if isinstance(law, Coulomb) and law.side == 0 and not law.open:
                resting.append(i)
                info.append([0.0, 0.0, load, load_rate])
                continue
            force, slip, rates = law.rates(slide, speed, load, load_rate, y[self.slices[i]])
            out[self.slices[i]] = rates
            a = a - spec["slides"][i] * force / spec["mass"]
            info.append([force, slip, load, load_rate])
        if resting:
            rows = spec["slides"][resting]
            forces = np.linalg.lstsq(rows @ rows.T / spec["mass"], rows @ a, rcond=1e-12)[0]
            a = a - rows.T @ forces / spec["mass"]
            for i, force in zip(resting, forces):
                info[i][0] = force
        out[:n], out[n : 2 * n] = v, a
        for i, (force, slip, *_) in enumerate(info):
            out[self.size - 2 * len(self.laws) + 2 * i :][:2] = (
                force * (spec["slides"][i] @ v),
                slip,
            )
        return out, info

    def margins(self, t, y):
        """Return all event functions as (interface, number) and values."""
        info = self.evaluate(t, y)[1]
        names, values = [], []
        for i, law in enumerate(self.laws):
            q, v = (
                self.spec["slides"][i] @ y[: self.n],
                self.spec["slides"][i] @ y[self.n : 2 * self.n],
            )
            force, _, load, load_rate = info[i]
            found = law.events(q, v, load, load_rate, y[self.slices[i]], force)
            names += [(i, k) for k in range(len(found))]
            values += found
        return names, np.array(values)

    def start(self):
        """Return the state at the start, and set the directions of the laws."""
        spec = self.spec
        y = np.zeros(self.size)
        y[: self.n], y[self.n : 2 * self.n] = spec["z"], spec["v"]
        for law, part in zip(self.laws, self.slices):
            y[part] = law.start()
        for i, law in enumerate(self.laws):
            if isinstance(law, Coulomb):
                law.open = self.load(spec["faces"][i], 0.0, y)[0] < 0
            elif isinstance(law, Tanh):
                law.open = self.load(spec["faces"][i], 0.0, y)[0] < 0
        # The first motion follows from a short look ahead without friction.
        ahead = 1e-6 * self.longest
        rate = self.evaluate(ahead, y)[0][self.n : 2 * self.n]
        for i, law in enumerate(self.laws):
            if hasattr(law, "side") and not isinstance(law, Coulomb):
                law.side = 1.0 if spec["slides"][i] @ rate >= 0 else -1.0
        self.release(0.0, y)
        return y

    def release(self, t, y):
        """Release resting interfaces beyond their static friction."""
        for _ in self.laws:
            info = self.evaluate(t, y)[1]
            worst = None
            for i, law in enumerate(self.laws):
                if isinstance(law, Coulomb) and law.side == 0 and not law.open:
                    excess = abs(info[i][0]) / (law.static * max(info[i][2], 1e-300)) - 1
                    if excess > 1e-9 and (worst is None or excess > worst[0]):
                        worst = excess, i
            if worst is None:
                return
            self.laws[worst[1]].side = np.sign(info[worst[1]][0])

    def run(self, window: float):
        """Integrate to the end; return the measures of the last `window` seconds."""
        spec = self.spec
        end = spec["cycles"] * spec["period"]
        stops = [end]
        if spec["rows"] is not None:
            stops = sorted({*(t for t in spec["rows"][0] if 0 < t < end), end})
        stops = sorted({*stops, end - window})
        for law in self.laws:
            if isinstance(law, Iwan):
                law.scale = spec["length"] * spec["omega"][0]
                law.origin = spec["slides"][self.laws.index(law)] @ spec["z"]
        y, t = self.start(), 0.0
        self.found = {
            "output": [],
            "force": [[] for _ in self.laws],
            "slip": [[] for _ in self.laws],
            "stuck": np.zeros(len(self.laws)),
        }
        self.acceleration = []
        first = None
        for stop in stops:
            if t >= end - window * (1 + 1e-12) and first is None:
                first = y.copy()
            while t < stop:
                t, y = self.piece(t, y, stop, observe=first is not None)
        work = self.size - 2 * len(self.laws)
        out = {
            "relative_displacement_amplitude": np.ptp(self.found["output"]) / 2,
            "absolute_acceleration_peak": max(np.abs(self.acceleration)),
        }
        for i in range(len(self.laws)):
            suffix = f"_{i + 1}" if i else ""
            out["loop_area" + suffix] = (y - first)[work + 2 * i] * spec["period"] / window
            out["friction_force_peak" + suffix] = np.abs(self.found["force"][i]).max()
            out["slip_amplitude" + suffix] = np.ptp(self.found["slip"][i]) / 2
            out["stick_fraction" + suffix] = self.found["stuck"][i] / window
        out["friction_work"] = y[work::2].sum()
        return out

    def piece(self, t, y, stop, *, observe):
        """Integrate to the next event or stop; return time and state there."""
        scale = np.maximum(np.abs(y), self.spec["length"] * 1e-3)
        solver = DOP853(
            lambda t, y: self.evaluate(t, y)[0], t, y, stop, max_step=self.longest, rtol=self.rtol,
            atol=self.rtol * 1e-2 * np.maximum(scale, 1e-9 * scale.max()), first_step=min(self.longest / 50, stop - t),
        )  # fmt: skip
        begin = True
        while solver.status == "running":
            before = solver.t
            message = solver.step()
            if solver.status == "failed":
                raise RuntimeError(message)
            dense = solver.dense_output()
            grid = np.linspace(before, solver.t, LOOKS + 1)
            if begin:
                grid = np.concatenate(
                    [
                        [before + EDGE * (solver.t - before)],
                        before + (solver.t - before) * 10.0 ** np.arange(-6, 0),
                        grid[1:],
                    ]
                )
                begin = False
            event = self.first_event(dense, grid)
            last = solver.t if event is None else event[0]
            if observe:
                self.observe(dense, before, last)
            if event is not None:
                y = dense(last)
                self.change(last, y, event[1])
                return last, y
        return solver.t, solver.y

    def first_event(self, dense, grid):
        """Return (time, (interface, number)) of the first zero of an event function on a grid of times."""
        old = None
        for left, right in pairwise(grid):
            if old is None:
                old = self.margins(left, dense(left))[1]
            names, new = self.margins(right, dense(right))
            best = None
            for k in np.flatnonzero(new < -ZERO):

                def function(t, k=k):
                    return self.margins(t, dense(t))[1][k]

                root = left
                if old[k] > 0:
                    root = brentq(function, left, right, xtol=1e-18, rtol=1e-15)
                if best is None or root < best[0]:
                    best = root, names[k]
            if best is not None:
                return best
            old = new
        return None

    def change(self, t, y, name):
        """Change the regime of a law at an event."""
        self.n_events += 1
        i, number = name
        info = self.evaluate(t, y)[1]
        law = self.laws[i]
        row = self.spec["slides"][i]
        law.switch(
            number,
            row @ y[: self.n],
            row @ y[self.n : 2 * self.n],
            info[i][2],
            y[self.slices[i]],
            info[i][0],
        )
        if isinstance(law, Coulomb) and law.side == 0:
            for j, other in enumerate(self.laws):
                other_row = self.spec["slides"][j]
                if (
                    isinstance(other, Coulomb)
                    and not other.open
                    and (j == i or abs(other_row @ y[self.n : 2 * self.n]) < 1e-13)
                ):
                    other.side = 0.0
                    y[self.n : 2 * self.n] -= (
                        other_row * (other_row @ y[self.n : 2 * self.n]) / (other_row @ other_row)
                    )
        self.release(t, y)

    def observe(self, dense, left, right):
        """Add a part of a step to the measures of the window."""
        times = np.linspace(left, right, 9)
        states = [dense(t) for t in times]
        spec, n = self.spec, self.n
        speeds = [spec["output"] @ y[n : 2 * n] for y in states]
        for k in range(8):
            if speeds[k] * speeds[k + 1] < 0:
                root = brentq(
                    lambda t: spec["output"] @ dense(t)[n : 2 * n],
                    times[k],
                    times[k + 1],
                    xtol=1e-16,
                    rtol=1e-14,
                )
                self.found["output"].append(spec["output"] @ dense(root)[:n])
        moves = spec["kind"] != "release"
        work = self.size - 2 * len(self.laws)
        stick_before = None
        for t, y in zip(times, states):
            rates, info = self.evaluate(t, y)
            self.found["output"].append(spec["output"] @ y[:n])
            self.acceleration.append(
                spec["output"] @ rates[n : 2 * n] + (self.drive(t) if moves else 0.0)
            )
            for i in range(len(self.laws)):
                self.found["force"][i].append(info[i][0])
                self.found["slip"][i].append(y[work + 2 * i + 1])
            stick = np.array([self.sticks(i, t, y, info) for i in range(len(self.laws))])
            if stick_before is not None:
                step = times[1] - times[0]
                for i in range(len(self.laws)):
                    a, b = stick_before[i], stick[i]
                    if (a < 0) == (b < 0):
                        self.found["stuck"][i] += step * (a < 0)
                    else:
                        root = brentq(
                            lambda s, i=i: self.stick_at(i, dense, s), t - step, t, rtol=1e-14
                        )
                        self.found["stuck"][i] += (root - t + step) if a < 0 else (t - root)
            stick_before = stick
        # Extremes of force and slip between the samples, by parabolas.
        for series in (*self.found["force"], *self.found["slip"], self.acceleration):
            tail = np.array(series[-9:])
            for sign in (1, -1):
                k = int(np.argmax(sign * tail[1:8])) + 1
                a, b, c = tail[k - 1 : k + 2]
                bend = a - 2 * b + c
                if sign * bend < 0 and abs(0.5 * (c - a) / bend) < 1:
                    series.append(b - (c - a) ** 2 / (8 * bend))

    def stick_at(self, i, dense, t):
        """Return `sticks` of an interface on the dense output."""
        y = dense(t)
        return self.sticks(i, t, y, self.evaluate(t, y)[1])

    def sticks(self, i, t, y, info):
        """Return |slip rate| - |velocity|/2 of an interface, negative while it sticks."""
        law = self.laws[i]
        if isinstance(law, Coulomb) and law.side == 0 and not law.open:
            return -1.0
        velocity = self.spec["slides"][i] @ y[self.n : 2 * self.n]
        return abs(info[i][1]) - 0.5 * abs(velocity)


def integrate(spec: dict, rtol: float = 1e-10, steps: int = 40) -> dict:
    """Return the measures of the last cycles of a spec: ten, or a tenth of the run where that is shorter."""
    window = max(1, min(10, spec["cycles"] // 10)) * spec["period"]
    reference = Reference(spec, rtol, steps)
    return reference.run(window)
