"""An independent model of a dispersed vehicle, written from the equations and not from the program.

It reads vehicle.toml, the modal package and the draws stored in `cases`, and assembles M, D and K
from the block formulas (5), (6), (13), (14) and the KKT system (16) of the paper, with slosh masses
locked. Every entry comes with its `size`, the sum of the moduli of the terms it is made of: rounding
cannot move an entry by more than a modest multiple of machine epsilon times that.
"""

import fnmatch
import functools
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

G = 9.80665


class Sized:
    """A matrix and the sum of the moduli of the terms of each of its entries."""

    def __init__(self, value, size=None):
        self.value = np.atleast_2d(np.asarray(value, float))
        self.size = np.abs(self.value) if size is None else size

    def __matmul__(self, other):
        return Sized(self.value @ other.value, self.size @ other.size)

    def __add__(self, other):
        return Sized(self.value + other.value, self.size + other.size)

    def __sub__(self, other):
        return Sized(self.value - other.value, self.size + other.size)

    def __rmul__(self, factor):
        return Sized(factor * self.value, abs(factor) * self.size)

    def __neg__(self):
        return -1.0 * self

    @property
    def T(self):
        return Sized(self.value.T, self.size.T)

    def add(self, rows, columns, block):
        at = np.ix_(rows, columns)
        self.value[at] += block.value
        self.size[at] += block.size


def skew(a):
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a):
    return Sized(skew(a))


# ---------------------------------------------------------------- what the files say


class Package:
    """The modal package of a vehicle."""

    def __init__(self, folder):
        read = lambda table: pd.read_parquet(folder / "tables" / f"{table}.parquet")
        self.grids, self.modes, self.shapes = read("grids"), read("modes"), read("shapes")
        self.mass, self.parents = read("mass"), read("parents")

    @functools.cache
    def at(self, time):
        """Labels, frequencies, and Φ and Ψ (3×k) by grid."""
        modes = self.modes[self.modes.flight_time_s == time]
        labels = list(modes.label)
        shapes = self.shapes[self.shapes.flight_time_s == time]
        phi, psi = {}, {}
        for grid, rows in shapes.groupby("grid"):
            rows = rows.set_index("label").loc[labels]
            phi[grid] = rows[[f"phi_{c}_per_sqrt_kg" for c in "xyz"]].to_numpy().T
            psi[grid] = rows[[f"psi_{c}_rad_per_m_sqrt_kg" for c in "xyz"]].to_numpy().T
        grids = self.grids[self.grids.flight_time_s == time].set_index("grid")
        where = {name: row.to_numpy() for name, row in grids[["x_m", "y_m", "z_m"]].iterrows()}
        mass = float(self.mass[self.mass.flight_time_s == time].mass_kg.iloc[0])
        return labels, modes.frequency_hz.to_numpy(), phi, psi, where, mass

    @functools.cache
    def ancestor(self, label):
        """The label under which a label draws."""
        while True:
            of = self.parents[(self.parents.label == label) & (self.parents.overlap > 0.5)]
            if of.empty:
                return label
            label = of.parent.iloc[0]

    @functools.cache
    def band_hz(self, label, time):
        """Nominal frequency at the band time, or the nearest flight time with the label."""
        family = [l for l in self.modes.label.unique() if self.ancestor(l) == self.ancestor(label)]
        found = self.modes[self.modes.label.isin(family)].copy()
        found["own"] = found.label != self.ancestor(label)
        found["distance"] = (found.flight_time_s - time).abs()
        order = ["distance", "flight_time_s", "own", "frequency_hz"]
        return float(found.sort_values(order).frequency_hz.iloc[0])


class Vehicle:
    def __init__(self, folder):
        self.file = tomllib.loads((Path(folder) / "vehicle.toml").read_text())
        self.package = Package(Path(folder) / self.file["modal_package"])
        self.engines = [f"{e['group']}.{e['name']}" for e in self.file["engine"]]
        # Alternative actuators are no part of the models here.
        for engine in self.file["engine"]:
            engine["actuator"] = [a for a in engine["actuator"] if "set" not in a]


# ---------------------------------------------------------------- dispersions

TEMPLATES = """structure.damping modes.<label>.damping modes.<label>.frequency
<group>.<engine>.thrust <group>.<engine>.specific_impulse <group>.<engine>.flow_profile
<group>.<engine>.mass_flow <group>.<engine>.nozzle.mass <group>.<engine>.nozzle.cg
<group>.<engine>.nozzle.inertia <group>.<engine>.nozzle.axial_inertia <group>.<engine>.nozzle.length
<group>.<engine>.nozzle.ablation <group>.<engine>.bearing.stiffness <group>.<engine>.bearing.damping
<group>.<engine>.actuator.<actuator>.stiffness <group>.<engine>.actuator.<actuator>.damping
<group>.<engine>.gimbal.<label>.shape <group>.<engine>.gimbal.<label>.slope
tank.<tank>.slosh.mass tank.<tank>.slosh.frequency tank.<tank>.slosh.damping
body.roll_inertia body.pitch_inertia body.yaw_inertia""".split()


@dataclass
class Draw:
    """One draw key: the row it comes from and the parameters it acts on."""

    key: str
    row: dict
    targets: list


def instances(vehicle, template):
    """Paths of a template in a vehicle, each with its modal label, if any."""
    labels = sorted(vehicle.package.modes.label.unique()) if "<label>" in template else [None]
    engines = vehicle.file["engine"] if "<engine>" in template else [None]
    if "<tank>" in template:
        yield from ((template.replace("<tank>", t["name"]), None) for t in vehicle.file["tank"])
        return
    for engine in engines:
        if engine and template.endswith("ablation") and "ablation" not in engine["nozzle"]:
            continue
        actuators = [a["name"] for a in engine["actuator"]] if "<actuator>" in template else [None]
        for label in labels:
            for actuator in actuators:
                path = template.replace("<label>", label or "").replace("<actuator>", actuator or "")
                if engine:
                    path = path.replace("<group>", engine["group"])
                    path = path.replace("<engine>", engine["name"])
                yield path, label


def expansion(level):
    """Segments of a template that a row expands to the instance at its level."""
    return {
        "vehicle": [],
        "actuator": ["<group>", "<engine>", "<actuator>"],
        "mode": ["<group>", "<engine>", "<label>"],
        "tank": ["<tank>"],
    }.get(level, ["<group>", "<engine>"])


def draws(vehicle, table):
    """Draw keys of a dispersion table, by key."""
    found = {}
    for row in table["row"]:
        written = row["path"].split(".")
        names = ["vehicle", "actuator", "mode", "tank"]
        level = row["level"] if row["level"] in names else "engine"
        for template in TEMPLATES:
            segments = template.split(".")
            if len(segments) != len(written):
                continue
            for path, label in instances(vehicle, template):
                own = path.split(".")
                fits = (w == o or (w == "*" and s[0] == "<") for w, s, o in zip(written, segments, own))
                if not all(fits):
                    continue
                if "band_hz" in row:
                    low, high = row["band_hz"]
                    band = vehicle.package.band_hz(label, vehicle.file["structure"]["band_time_s"])
                    if not low <= band < high:
                        continue
                if label:
                    own[segments.index("<label>")] = vehicle.package.ancestor(label)
                parts = [o if s in expansion(level) else w for w, s, o in zip(written, segments, own)]
                key = f"{'.'.join(parts)} @ {level}" + (f" # {row['id']}" if "id" in row else "")
                found.setdefault(key, Draw(key, row, [])).targets.append(path)
    return found


class Case:
    """The parameters of one case: a nominal value goes in, the drawn one comes out."""

    def __init__(self, draws, values):
        self.by_path = {}
        for key, draw in draws.items():
            value = values.get(key)
            if value is not None and not np.isnan(value):
                for path in draw.targets:
                    self.by_path.setdefault(path, []).append((draw.row["apply"], value))

    def __call__(self, path, nominal):
        acts = self.by_path.get(path, [])
        for value in (v for apply, v in acts if apply == "absolute"):
            nominal = value
        for value in (v for apply, v in acts if apply == "scale"):
            nominal = nominal * value
        for value in (v for apply, v in acts if apply == "offset"):
            nominal = nominal + value
        return nominal


# ---------------------------------------------------------------- the model


def unit(a):
    return np.array(a, float) / np.linalg.norm(a)


def gimbal_axes(engine, arms, lines):
    """T: the two gimbal axes, orthonormal and normal to the nozzle, first actuator first."""
    u = unit(engine["thrust_direction"])
    raw = engine.get("axes") or [np.cross(r, b) for r, b in zip(arms, lines)]
    first = unit(np.array(raw[0]) - np.dot(raw[0], u) * u)
    second = np.array(raw[1]) - np.dot(raw[1], u) * u
    return np.column_stack([first, unit(second - np.dot(second, first) * first)])


def virtual_slope(arms, lines, shapes):
    """(16) to (22): Ψ_G from the KKT system, as printed."""
    a = np.column_stack([np.cross(r, b) for r, b in zip(arms, lines)] + [np.zeros((3, 3))])
    c = np.column_stack([*lines, np.eye(3)])
    kkt = np.block([[2 * a.T @ a, c.T], [c, np.zeros((3, 3))]])
    m = Sized(np.linalg.inv(kkt)[:5, :5] @ (2 * a.T))
    gimbal, first, second = (Sized(s) for s in shapes)
    part = lambda rows, shape: Sized(m.value[rows].T, m.size[rows].T) @ shape
    along = lambda line, shape: Sized(line[None, :]) @ shape
    return (
        part([2, 3, 4], gimbal)
        + part([0], along(lines[0], first))
        + part([1], along(lines[1], second))
    )


def case_per_flow(positions, phi, psi):
    """(14) by its sum over the intervals: Q_c = ṁ C η̇."""
    x = [p - positions[0] for p in positions]
    length, k = x[-1], phi[0].shape[1]
    total = Sized(np.zeros((k, k)))
    flow = cross([1.0, 0.0, 0.0])
    for j in range(len(x) - 1):
        term = Sized(np.zeros((k, k)))
        for i in (j, j + 1):
            term = term + x[i] * (Sized(phi[i]).T @ flow @ Sized(psi[i]))
        total = total + ((x[j + 1] - x[j]) / length) * term
    return total


def stations(engine, where):
    """Case centreline grids along the flow, the throat last."""
    throat = engine.get("throat_grid", engine["gimbal_grid"])
    found = []
    for pattern in engine.get("case_stations", []):
        names = fnmatch.filter(where, pattern) if "*" in pattern else [pattern]
        ahead = [n for n in names if where[n][0] < where[throat][0]]
        found += sorted(ahead, key=lambda n: where[n][0])
    return found + [throat] if found else []


def nozzle(engine, path, case, burned):
    """Mass, cg distance, J about the pivot, axial J: drawn, then less the liner loss."""
    n = engine["nozzle"]
    of = lambda name, nominal: case(f"{path}.nozzle.{name}", nominal)
    m, r = of("mass", n["mass_kg"]), of("cg", n["cg_m"])
    j, axial = of("inertia", n["inertia_kg_m2"]), of("axial_inertia", n["axial_inertia_kg_m2"])
    if loss := n.get("ablation"):
        share = of("ablation", loss.get("factor", 1.0)) * burned
        m -= share * loss["mass_loss_kg"]
        r += share * loss["cg_change_m"]
        j -= share * loss["inertia_loss_kg_m2"]
    return m, r, j, axial


def slosh_mass(tank, path, case, time):
    """m_1 of a flat-bottomed cylinder, first antisymmetric mode (NASA SP-106), as drawn."""
    xi, liquid = 1.8411837813406593, np.interp(time, tank["time_s"], tank["liquid_kg"])
    radius, density = tank["cylinder"]["radius_m"], tank["cylinder"]["density_kg_m3"]
    depth = xi * liquid / (density * np.pi * radius**3)
    return case(f"{path}.mass", liquid * 2 * np.tanh(depth) / (depth * (xi**2 - 1)))


class Motor:
    """Thrust, flow, specific impulse and burned fraction of an engine at a time, as drawn."""

    def __init__(self, vehicle, engine, path, case, time):
        motor = next(m for m in vehicle.file["motor"] if m["name"] == engine["motor"])
        at = lambda name: np.interp(time, motor["time_s"], motor[name])
        nominal = at("thrust_n")
        impulse = motor["specific_impulse_s"]
        profile = at("mass_flow_kg_s") * impulse * G / nominal
        self.thrust = case(f"{path}.thrust", nominal)
        impulse = case(f"{path}.specific_impulse", impulse)
        profile = case(f"{path}.flow_profile", profile)
        self.flow = case(f"{path}.mass_flow", self.thrust / (impulse * G) * profile)
        self.burned = at("burned_fraction") if "burned_fraction" in motor else 0.0


def assemble(vehicle, time, variant, gimballed, case=None, coupling=1.0, push=1.0):
    """M, D, K and the names of the coordinates; `coupling` scales the inertia between η and Θ and of
    engines and slosh masses on η, `push` thrust and flow (both for continuation)."""
    case = case or Case({}, {})
    labels, hertz, phi, psi, where, body = vehicle.package.at(time)
    k, names = len(labels), [f"eta.{label}" for label in labels]
    for engine in vehicle.file["engine"]:
        path = f"{engine['group']}.{engine['name']}"
        if path in gimballed:
            names += [f"theta.{path}.{a['name']}" for a in engine["actuator"]]
    n = len(names)
    M, D, K = (Sized(np.zeros((n, n))) for _ in range(3))
    eta = list(range(k))
    common = case("structure.damping", vehicle.file["structure"]["damping_ratio"])
    for i, label in enumerate(labels):
        omega = 2 * np.pi * case(f"modes.{label}.frequency", hertz[i])
        zeta = case(f"modes.{label}.damping", common)
        M.add([i], [i], Sized(1.0))
        D.add([i], [i], Sized(2 * zeta * omega))
        K.add([i], [i], Sized(omega**2))

    engines = []
    for engine in vehicle.file["engine"]:
        path = f"{engine['group']}.{engine['name']}"
        motor = Motor(vehicle, engine, path, case, time)
        engines.append((engine, path, motor, nozzle(engine, path, case, motor.burned)))
    # With slosh off, a slosh mass is locked to its tank.
    locked = [(t["grid"], slosh_mass(t, f"tank.{t['name']}.slosh", case, time)) for t in vehicle.file["tank"]]
    for grid, mass in locked:
        M.add(eta, eta, coupling * (mass * (Sized(phi[grid]).T @ Sized(phi[grid]))))
    body += sum(mass for _, mass in locked)
    on = push if variant["thrust"] else 0.0
    force = sum(on * motor.thrust * unit(e["thrust_direction"]) for e, _, motor, _ in engines)
    g0 = force / (body + sum(m for *_, (m, *_) in engines))

    for engine, path, motor, (m, r, j, axial) in engines:
        u = unit(engine["thrust_direction"])
        flow_direction = cross(-u)
        gimbal = engine["gimbal_grid"]
        attach = [a["attach_grid"] for a in engine["actuator"]]
        arms = [
            np.array(a["attach_m"]) if "attach_m" in a else where[a["attach_grid"]] - where[gimbal]
            for a in engine["actuator"]
        ]
        lines = [unit(a["action_line"]) for a in engine["actuator"]]
        if variant["slope"] == "virtual_grid":
            slope = virtual_slope(arms, lines, [phi[g] for g in [gimbal, *attach]])
        else:
            slope = Sized(psi[gimbal])
        gains = lambda what: Sized(
            np.diag([case(f"{path}.gimbal.{label}.{what}", 1.0) for label in labels])
        )
        Phi, Psi = Sized(phi[gimbal]) @ gains("shape"), slope @ gains("slope")
        re = cross(-u * r)
        J = j * Sized(np.eye(3) - np.outer(u, u)) + axial * Sized(np.outer(u, u))
        Gamma = Phi - re @ Psi
        M.add(eta, eta, coupling * (m * (Gamma.T @ Gamma) + Psi.T @ (J + m * (re @ re)) @ Psi))

        length = case(f"{path}.nozzle.length", engine["nozzle"]["length_m"])
        thrust, flow = on * motor.thrust, on * motor.flow
        if variant["case_jet_damping"] and (names_of := stations(engine, where)):
            along = [where[g][0] for g in names_of]
            D.add(eta, eta, -flow * case_per_flow(along, [phi[g] for g in names_of], [psi[g] for g in names_of]))
        rotations = [(eta, Psi)]
        if path in gimballed:
            first = names.index(f"theta.{path}.{engine['actuator'][0]['name']}")
            theta, T = [first, first + 1], Sized(gimbal_axes(engine, arms, lines))
            rotations.append((theta, T))
            block = coupling * (T.T @ (m * (re @ Phi) + J @ Psi))
            M.add(theta, eta, block)
            M.add(eta, theta, block.T)
            M.add(theta, theta, T.T @ J @ T)
            K.add(theta, theta, T.T @ (m * (cross(g0) @ re)) @ T)
            K.add(eta, theta, thrust * (Phi.T @ cross(u) @ T))
            for axis, actuator in enumerate(engine["actuator"]):
                J_ref = engine["nozzle"]["inertia_kg_m2"]
                nominal = actuator.get("stiffness_n_m_rad")
                if nominal is None:
                    nominal = J_ref * (2 * np.pi * actuator["frequency_hz"]) ** 2
                of = f"{path}.actuator.{actuator['name']}"
                bearing = engine.get("bearing", {})
                stiffness = case(f"{of}.stiffness", nominal)
                separate = actuator.get("bearing", "included") == "separate"
                if separate:
                    stiffness += case(f"{path}.bearing.stiffness", bearing["stiffness_n_m_rad"])
                zeta = case(f"{of}.damping", actuator["damping_ratio"])
                damping = 2 * zeta * np.sqrt(J_ref * nominal)
                if separate:
                    damping += case(f"{path}.bearing.damping", bearing.get("damping_n_m_s_rad", 0.0))
                K.add([theta[axis]], [theta[axis]], Sized(stiffness))
                D.add([theta[axis]], [theta[axis]], Sized(damping))
        if variant["follower_thrust"]:
            K.add(eta, eta, thrust * (Phi.T @ cross(u) @ Psi))
        if variant["nozzle_jet_damping"] != "off":
            for columns, turned in rotations:
                D.add(eta, columns, -2 * flow * length * (Phi.T @ flow_direction @ turned))
        if variant["nozzle_jet_damping"] == "rigid_nozzle":
            # Lever x î of a station in the nozzle: the part of (8) quadratic in the length.
            for rows, moved in rotations:
                for columns, turned in rotations:
                    square = moved.T @ flow_direction.T @ flow_direction @ turned
                    D.add(rows, columns, flow * length**2 * square)
    return M, D, K, names


def state_matrix(M, D, K):
    n = len(M)
    lower = -np.linalg.solve(M, np.hstack([K, D]))
    return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower])
