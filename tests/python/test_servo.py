"""Actuators, filters, delays and closed loops that the program exports, against python-control."""

import shutil
import tomllib

import control
import numpy as np
import pandas as pd
import pytest
import scipy.linalg

from conftest import ROOT, tvse

AXES = ["roll", "pitch", "yaw"]
TAU = 2 * np.pi
PLANT = 'case_jet_damping = true\nnozzle_jet_damping = "equation-13"\nrigid_body = true\nactuators = "electrohydraulic"'

# Alternative actuators by transfer functions and matrices, for the left booster.
OTHERS = """
[[engine.actuator]]
name = "rock_tf"
set = "transfer"
kind = "transfer-function"
bearing = "separate"
transfer_function = { numerator = [2.0e8, 5.0e9], denominator = [1.0, 90.0], command_numerator = [6.0e9], command_denominator = [1.0, 90.0], damping_n_m_s_rad = 2.0e4 }

[[engine.actuator]]
name = "tilt_ss"
set = "transfer"
kind = "state-space"
bearing = "included"
state_space = { a = [[-30.0, 4.0], [-5.0, -60.0]], b = [[1.0, -1.0, 0.0], [0.5, -0.4, -0.01]], c = [4.0e8, 3.0e8], d = [2.0e7, -3.0e7, -2.0e5] }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study: the reference vehicle with the autopilot of the tests and further actuators."""
    folder = tmp_path_factory.mktemp("servo")
    for inputs in ["vehicles", "dispersions"]:
        shutil.copytree(ROOT / inputs, folder / inputs)
    path = folder / "vehicles/sls-like/vehicle.toml"
    text = path.read_text().split("\n[autopilot]")[0]
    head, left, rest = text.split("[[engine]]\n", 2)
    autopilot = (ROOT / "tests/python/autopilot.toml").read_text()
    path.write_text("[[engine]]\n".join([head, left + OTHERS + "\n", rest]) + "\n" + autopilot)
    variants = "".join(
        f'\n[[variant]]\nname = "{name}"\nfeedback = "{name}"\n{PLANT}\n' for name in ["open", "closed", "inverted"]
    )
    (folder / "run.toml").write_text(
        'vehicle = "vehicles/sls-like"\ndispersion = "dispersions/reference.toml"\ncases = 3\nseed = 7\n'
        f'flight_times_s = [105.0]\nmodes = ["tvse"]\ngimballed = ["booster.*"]\n{variants}'
    )
    return folder


@pytest.fixture(scope="module")
def vehicle(folder):
    return tomllib.loads((folder / "vehicles/sls-like/vehicle.toml").read_text())


class Model:
    """A state space that `tvse model` wrote, as python-control has it."""

    def __init__(self, folder):
        names = pd.read_parquet(folder / "names.parquet")
        of = lambda kind: list(names[names.kind == kind].name)
        self.states, self.inputs, self.outputs = of("state"), of("input"), of("output")
        entries = pd.read_parquet(folder / "state_space.parquet")
        sizes = {"A": (self.states, self.states), "B": (self.states, self.inputs)}
        sizes |= {"C": (self.outputs, self.states), "D": (self.outputs, self.inputs)}
        matrices = []
        for name, (rows, columns) in sizes.items():
            matrix = np.zeros((len(rows), len(columns)))
            found = entries[entries.matrix == name]
            matrix[found.row.astype(int), found.column.astype(int)] = found.value
            assert [rows[i] for i in found.row.astype(int)] == list(found.row_name)
            assert [columns[i] for i in found.column.astype(int)] == list(found.column_name)
            matrices.append(matrix)
        ports = {"inputs": self.inputs, "outputs": self.outputs, "states": self.states}
        plain = lambda names: [n.replace(".", "_") for n in names]
        self.system = control.ss(*matrices, **{k: plain(v) for k, v in ports.items()})

    def part(self, outputs, inputs):
        rows = [self.outputs.index(name) for name in outputs]
        columns = [self.inputs.index(name) for name in inputs]
        a, b, c, d = self.system.A, self.system.B, self.system.C, self.system.D
        return control.ss(a, b[:, columns], c[rows], d[np.ix_(rows, columns)])


@pytest.fixture(scope="module")
def models(folder):
    """Models of the nominal case and of two dispersed ones, by population, case and variant."""
    found = {}
    for population, case in [("nominal", 0), ("dispersed", 0), ("dispersed", 2)]:
        for variant in ["open", "closed", "inverted"]:
            target = folder / f"{population}-{case}-{variant}"
            words = ["--population", population, "--case", case, "--variant", variant, "--time", 105]
            tvse("model", folder / "run.toml", *words, "-o", target)
            found[population, case, variant] = Model(target)
    return found


# ---------------------------------------------------------------- actuators


def torque(actuator, engine, arm):
    """Transfer functions of the torque from command and from rotation (Θ̇ = s Θ)."""
    s = control.tf("s")
    match actuator["kind"]:
        case "second-order":
            inertia = engine["nozzle"]["inertia_kg_m2"]
            k = actuator.get("stiffness_n_m_rad") or inertia * (TAU * actuator["frequency_hz"]) ** 2
            c = 2 * actuator["damping_ratio"] * np.sqrt(inertia * k)
            return control.tf([k], [1]), -(k + c * s)
        case "electrohydraulic":
            # Valve, amplifier, cylinder and load path one by one, the load pressure P as unknown:
            # Q = K_q i - K_q/K_p P = A ẋ_p + A²/K_h Ṗ + C_l P, i = K_x (r δ - x_p) - K_f s/(s+ω) P,
            # x_p = r Θ + A P/K_s.
            e = actuator["electrohydraulic"]
            area, flow = e["piston_area_m2"], e["valve_flow_gain_m3_s_a"]
            corner = TAU * e["pressure_corner_hz"]
            high_pass = control.tf([1, 0], [1, corner])
            compliance = area / e["load_path_stiffness_n_m"]
            of_pressure = (
                area * s * compliance
                + area**2 / e["oil_stiffness_n_m"] * s
                + e["leakage_m3_s_pa"]
                + flow / e["valve_pressure_gain_pa_a"]
                + flow * e["position_gain_a_m"] * compliance
                + flow * e["pressure_feedback_a_pa"] * high_pass
            )
            of_command = control.tf([flow * e["position_gain_a_m"] * arm], [1])
            of_rotation = -(flow * e["position_gain_a_m"] * arm + area * arm * s)
            return of_command / of_pressure * area * arm, of_rotation / of_pressure * area * arm
        case "transfer-function":
            t = actuator["transfer_function"]
            load = control.tf(t["numerator"], t["denominator"]) + t["damping_n_m_s_rad"] * s
            return control.tf(t["command_numerator"], t["command_denominator"]), -load
        case "state-space":
            m = actuator["state_space"]
            g = control.ss2tf(m["a"], m["b"], np.atleast_2d(m["c"]), np.atleast_2d(m["d"]))
            return g[0, 0], g[0, 1] + g[0, 2] * s


def test_actuator_responses_are_those_of_python_control(folder, vehicle):
    target = folder / "response.parquet"
    tvse("actuator", folder / "vehicles/sls-like", "--response", target, "--frequencies", "0.05:80:41")
    table = pd.read_parquet(target)
    engines = {f"{e['group']}.{e['name']}": e for e in vehicle["engine"]}
    s = control.tf("s")
    seen = set()
    for (path, name, nozzle), rows in table.groupby(["engine", "actuator", "nozzle"]):
        engine = engines[path]
        actuator = next(a for a in engine["actuator"] if a["name"] == name)
        kind = actuator["kind"]
        # Axial action lines, attached at 45° on a circle of this radius.
        drive, load = torque(actuator, engine, 1.79)
        inertia = engine["nozzle"]["inertia_kg_m2"]
        if nozzle == "ablated":
            inertia -= engine["nozzle"]["ablation"]["inertia_loss_kg_m2"]
        default = {"second-order": "included", "electrohydraulic": "separate"}
        separate = actuator.get("bearing", default.get(kind)) == "separate"
        bearing = engine.get("bearing", {}).get("stiffness_n_m_rad", 0.0) if separate else 0.0
        w = TAU * rows.frequency_hz.to_numpy()
        at = lambda g: g(1j * w)
        stiffness = at(inertia * s**2) + bearing - at(load)
        compliance = rows.compliance_re_rad_n_m + 1j * rows.compliance_im_rad_n_m
        # The vehicle file has the attach points to four digits, and so the arm.
        np.testing.assert_allclose(compliance, 1 / stiffness, rtol=1e-4)
        command = rows.command_re + 1j * rows.command_im
        np.testing.assert_allclose(command, at(drive) / stiffness, rtol=1e-4)
        np.testing.assert_allclose(rows.compliance_phase_deg, np.angle(compliance, deg=True), atol=1e-9)
        np.testing.assert_allclose(rows.command_magnitude, np.abs(command), rtol=1e-12)
        seen.add(kind)
    assert seen == {"second-order", "electrohydraulic", "transfer-function", "state-space"}


# ---------------------------------------------------------------- integrators

# Integral action in pitch, as a filter and as a pole at zero of a transfer function.
INTEGRAL = {
    "integrator": '{ kind = "integrator" }',
    "transfer": '{ kind = "transfer-function", numerator = [0.3, 1.0], denominator = [1.0, 0.0] }',
}
LOOPS = {
    "closed": "rigid_body = true\nslosh = true",
    "air": "rigid_body = true\naerodynamics = true",
    "held": "rigid_body = false",
    "coasting": "rigid_body = true\nthrust = false",
}


@pytest.mark.parametrize("kind", INTEGRAL)
def test_a_loop_with_integral_action_has_the_poles_that_numpy_finds(tmp_path, kind):
    for inputs in ["vehicles", "dispersions"]:
        shutil.copytree(ROOT / inputs, tmp_path / inputs)
    path = tmp_path / "vehicles/sls-like/vehicle.toml"
    integral = (
        '[[autopilot.path]]\nname = "integral"\ninput = { "attitude.platform.pitch" = 1.0 }\n'
        f"gain = 0.02\nfilter = [{INTEGRAL[kind]}]\n\n"
    )
    text = path.read_text()
    named = '[[autopilot.path]]\nname = "pitch"\n'
    reads = '"path.pitch_attitude" = 1.0 }'
    assert named in text and reads in text
    text = text.replace(reads, '"path.pitch_attitude" = 1.0, "path.integral" = 1.0 }')
    path.write_text(text.replace(named, integral + named))
    jets = 'case_jet_damping = true\nnozzle_jet_damping = "equation-13"\nfeedback = "closed"'
    variants = "".join(f'\n[[variant]]\nname = "{n}"\n{jets}\n{v}\n' for n, v in LOOPS.items())
    (tmp_path / "run.toml").write_text(
        'vehicle = "vehicles/sls-like"\ndispersion = "dispersions/closed-loop.toml"\ncases = 2\nseed = 7\n'
        f'flight_times_s = [105.0]\nmodes = ["tvse"]\ngimballed = ["booster.*"]\n'
        f'[sensitivity]\n[margins]\nvariants = ["closed", "air"]\n{variants}'
    )
    tvse("nominal", tmp_path / "run.toml")
    tvse("run", tmp_path / "run.toml", "-o", tmp_path / "run")
    if kind == "integrator":
        tvse("influence", tmp_path / "run", "--variant", "air", "--top", 2)
        tvse("worst", tmp_path / "run", "--variant", "closed")
    modes = pd.read_parquet(tmp_path / "run/tables/modes.parquet")
    assert (modes.status == "ok").all()
    for case in [0, 1]:
        words = ["--population", "dispersed", "--case", case]
        tvse("replay", tmp_path / "run", *words, "-o", tmp_path / f"replay-{case}")
        replayed = pd.read_parquet(tmp_path / f"replay-{case}/poles.parquet")
        for variant in LOOPS:
            target = tmp_path / f"{variant}-{case}"
            tvse("model", tmp_path / "run.toml", *words, "--variant", variant, "--time", 105, "-o", target)
            a, _ = scipy.linalg.matrix_balance(Model(target).system.A)
            theirs = np.linalg.eigvals(a)
            poles = replayed[replayed.variant == variant]
            ours = (poles.pole_re_rad_s + 1j * poles.pole_im_rad_s).to_numpy()
            near = np.abs(ours[:, None] - theirs[None, :]).min(axis=1)
            # Those of the null chains are found by numpy to the root of the rounding.
            told = np.abs(ours) > 0.01
            assert (near[told] <= 1e-7 * (1 + np.abs(ours[told]))).all(), (case, variant)
            # All poles there are, and the integrator's where the loop is closed around it.
            missed = np.abs(theirs[theirs.imag >= 0][:, None] - ours[None, :]).min(axis=1)
            assert (np.abs(theirs[theirs.imag >= 0])[missed > 1e-6] < 0.01).all(), (case, variant)
            null = modes[(modes.variant == variant) & (modes.population == "dispersed") & (modes.case == case)]
            solved = (1 + (ours.imag > 0)).sum()
            assert (null.null_poles + solved == len(a)).all(), (case, variant)


# ---------------------------------------------------------------- filters


def filter_system(f, order):
    w = lambda key: TAU * f[key]
    match f["kind"]:
        case "gain":
            return control.tf([f["value"]], [1])
        case "lag":
            return control.tf([1], [1 / w("frequency_hz"), 1])
        case "lead-lag":
            return control.tf([1 / w("zero_hz"), 1], [1 / w("pole_hz"), 1])
        case "notch":
            n = w("frequency_hz")
            return control.tf([1, 2 * f["zero_damping"] * n, n * n], [1, 2 * f["pole_damping"] * n, n * n])
        case "bending":
            z, p = w("zero_hz"), w("pole_hz")
            return control.tf(
                [1 / z**2, 2 * f["zero_damping"] / z, 1], [1 / p**2, 2 * f["pole_damping"] / p, 1]
            )
        case "low-pass":
            n = w("frequency_hz")
            return control.tf([1], [1 / n**2, 2 * f["damping"] / n, 1])
        case "section" | "transfer-function":
            return control.tf(f["numerator"], f["denominator"])
        case "integrator":
            return control.tf([1], [1, 0])
        case "delay":
            return control.tf(*control.pade(f["delay_s"], f.get("order", order)))


def feedback(vehicle):
    """The autopilot from sensor signals to feedback as python-control connects it, and its signals."""
    autopilot = vehicle["autopilot"]
    plain = lambda name: name.replace(".", "_")
    systems, signals = [], []
    for path in autopilot["path"]:
        chain = control.tf([path.get("gain", 1.0)], [1])
        for f in path.get("filter", []):
            chain = chain * filter_system(f, autopilot["delay_order"])
        name = f"path.{path['name']}"
        system = control.tf2ss(chain) if len(chain.den[0][0]) > 1 else control.ss([], [], [], chain.num[0][0] / chain.den[0][0])
        systems.append(control.ss(system, inputs=f"in_{plain(name)}", outputs=plain(name), name=plain(name)))
        weights = list(path["input"].items())
        signals += [s for s, _ in weights if not s.startswith("path.") and s not in signals]
        systems.append(
            control.ss(
                [], [], [], [[w for _, w in weights]],
                inputs=[plain(s) for s, _ in weights], outputs=f"in_{plain(name)}", name=f"sum_{plain(name)}",
            )
        )  # fmt: skip
    for axis in AXES:
        paths = [plain(f"path.{p['name']}") for p in autopilot["path"] if p.get("axis") == axis]
        delay = control.tf2ss(control.tf(*control.pade(autopilot["delay_s"], autopilot["delay_order"])))
        both = delay * control.ss([], [], [], np.ones((1, len(paths))))
        systems.append(control.ss(both, inputs=paths, outputs=f"feedback_{axis}", name=f"delay_{axis}"))
    whole = control.interconnect(
        systems, inputs=[plain(s) for s in signals], outputs=[f"feedback_{a}" for a in AXES], check_unused=False
    )
    return control.ss(whole.A, whole.B, whole.C, whole.D), signals


def response(system, w):
    return np.array([system(1j * x) for x in w])


def test_the_closed_loop_is_the_one_that_python_control_closes(models, vehicle):
    law, signals = feedback(vehicle)
    commands = [f"command.{a}" for a in AXES]
    for (population, case, variant), model in models.items():
        if variant == "open":
            continue
        plant = models[population, case, "open"].part(signals, commands)
        sign = -1 if variant == "closed" else 1
        expected = control.feedback(plant, law, sign=sign)
        found = model.part(signals, commands)
        w = TAU * np.geomspace(0.05, 20.0, 60)
        a, b = response(expected, w), response(found, w)
        scale = np.abs(a).max(axis=(1, 2), keepdims=True)
        assert (np.abs(a - b) <= 1e-6 * scale).all(), (population, case, variant)
        # Poles: every one of the program's is one of python-control's, to what rounding allows; those
        # near the origin belong to the null chain of the rigid body.
        ours, theirs = np.linalg.eigvals(found.A), expected.poles()
        assert len(ours) == len(theirs)
        ours = ours[np.abs(ours) > 0.05]
        near = np.abs(ours[:, None] - theirs[None, :]).min(axis=1)
        assert (near <= 1e-6 * (1 + np.abs(ours))).all(), (population, case, variant)


def balanced(system):
    """The same system in states of like size: the matrix exponential of rad beside Pa keeps no digits."""
    a, (scale, _) = scipy.linalg.matrix_balance(system.A, permute=False, separate=True)
    return control.ss(a, system.B / scale[:, None], system.C * scale, system.D)


def test_step_responses_are_those_of_the_loop_that_python_control_closes(models, vehicle):
    law, signals = feedback(vehicle)
    commands = [f"command.{a}" for a in AXES]
    t = np.linspace(0.0, 3.0, 301)
    step = lambda system: control.step_response(balanced(system), t, squeeze=False)[1]
    for (population, case, variant), model in models.items():
        if variant == "open":
            continue
        plant = models[population, case, "open"].part(signals, commands)
        closed = control.feedback(plant, law, sign=-1 if variant == "closed" else 1)
        expected, found = step(closed), step(model.part(signals, commands))
        # To the largest signal that a command moves; rounding grows with the least stable pole.
        growth = np.exp(t[-1] * max(np.linalg.eigvals(closed.A).real.max(), 0.0))
        scale = np.abs(expected).max(axis=(0, 2))
        error = np.abs(found - expected).max(axis=(0, 2))
        assert (error <= growth * len(closed.A) * np.finfo(float).eps * scale).all(), (population, case, variant)
        # Nothing responds at once, and what a command turns has moved within three seconds.
        assert (np.abs(expected[:, :, 0]).max(axis=0) <= 1e-12 * scale).all()
        assert (scale > 0.01).all()


def test_feedback_is_that_of_the_filters_in_python_control(models, vehicle):
    law, signals = feedback(vehicle)
    outputs = [f"feedback.{a}" for a in AXES]
    commands = [f"command.{a}" for a in AXES]
    closed = models["nominal", 0, "closed"]
    w = TAU * np.geomspace(0.05, 20.0, 40)
    y = response(closed.part(signals, commands), w)
    f = response(closed.part(outputs, commands), w)
    expected = response(law, w) @ y
    assert (np.abs(f - expected) <= 1e-8 * np.abs(expected).max(axis=(1, 2), keepdims=True)).all()


def test_an_axis_command_makes_a_moment_about_its_axis_alone(models):
    """Allocation by least squares: at low frequency a command of the nominal vehicle turns it so."""
    model = models["nominal", 0, "open"]
    sensors = [f"attitude.imu.{a}" for a in AXES]
    y = model.part(sensors, [f"command.{a}" for a in AXES])(1j * 0.3)
    for i in range(3):
        # Angle over angular acceleration is -1/w²: a positive command turns the positive way.
        assert y[i, i].real < 0
        assert all(abs(y[i, j]) < 0.05 * abs(y[i, i]) for j in range(3) if j != i), y
