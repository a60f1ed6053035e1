"""Loops of whole vehicles: curves, margins and counts of unstable poles against a plant assembled here from replayed
matrices, the modal package and the vehicle file, and against python-control."""

import io
import tomllib

import control
import numpy as np
import pandas as pd
import pytest

from conftest import ROOT, run_file, tvse

FEEDBACK = {"off": "open", "on": "closed", "wrong": "inverted"}
VARIANT = """
[[variant]]
name = "{}"
case_jet_damping = true
nozzle_jet_damping = "equation-13"
rigid_body = true
slosh = true
feedback = "{}"
"""
MARGINS = """
[margins]
variants = ["on", "wrong"]
[margins.envelope]
from_hz = 0.05
to_hz = 20.0
count = 25
"""
AXES = ["roll", "pitch", "yaw"]
TIMES = [95.0, 105.0]


@pytest.fixture(scope="module")
def loops(runs):
    variants = "".join(VARIANT.format(name, feedback) for name, feedback in FEEDBACK.items())
    # Sensors stay nominal here: replayed matrices hold everything else that is drawn.
    table = (ROOT / "dispersions/reference.toml").read_text()
    assert "autopilot" not in table and "gyro" not in table
    text = run_file("vehicles/sls-like", "dispersions/reference.toml", 4, TIMES, ["booster.*"], [])
    return runs("loops", text + MARGINS + variants)


@pytest.fixture(scope="module", params=[("nominal", 0), ("dispersed", 0), ("dispersed", 3)], ids=str)
def case(request, loops, tmp_path_factory):
    population, number = request.param
    return population, number, loops.replay(population, number, tmp_path_factory.mktemp("replay") / "r")


def dense(matrices, time, variant):
    """M, D and K of an evaluation, and the names of the coordinates."""
    found = matrices[(matrices.flight_time_s == time) & (matrices.variant == variant)]
    names = found[found.matrix == "M"].drop_duplicates("row").sort_values("row").row_name
    out = {}
    for name in "MDK":
        entries = found[found.matrix == name]
        out[name] = np.zeros((len(names), len(names)))
        out[name][entries.row.astype(int), entries.column.astype(int)] = entries.value
    return out, list(names)


class Plant:
    """P(jω), axis commands to the signals of the sensors with every loop open, and F(jω) of the vehicle file."""

    def __init__(self, run, tables, population, number, time):
        folder = next(run.folder.glob("inputs/**/vehicle.toml")).parent
        self.file = tomllib.loads((folder / "vehicle.toml").read_text())
        self.matrices, self.names = dense(tables["matrices"], time, "off")

        def at(table, time):
            found = pd.read_parquet(folder / f"modes/tables/{table}.parquet")
            return found[found.flight_time_s == time]

        grids = at("grids", time).set_index("grid")
        place = lambda grid: grids.loc[grid, ["x_m", "y_m", "z_m"]].to_numpy(float)
        # Allocation by least squares: unit moments about each axis, each column scaled to a largest entry of 1.
        moments, gimbals, stiffness = [], [], []
        # With thrust along x the station of the cg scales columns alone.
        cg = np.array([at("mass", time).cg_x_m.iloc[0], 0.0, 0.0])
        for engine in [e for e in self.file["engine"] if e["group"] == "booster"]:
            path, centre, axes = f"{engine['group']}.{engine['name']}", place(engine["gimbal_grid"]), []
            for actuator in [a for a in engine["actuator"] if "attach_grid" in a]:
                axis = np.cross(place(actuator["attach_grid"]) - centre, actuator["action_line"])
                for other in [np.array([1.0, 0, 0]), *axes]:
                    axis = axis - other * (other @ axis)
                axes.append(axis / np.linalg.norm(axis))
                moments.append(np.cross(centre - cg, np.cross(axes[-1], engine["thrust_direction"])))
                gimbals.append(self.names.index(f"theta.{path}.{actuator['name']}"))
                scale = drawn_stiffness(run, population, number, f"{path}.actuator.{actuator['name']}.stiffness")
                stiffness.append(actuator["stiffness_n_m_rad"] * scale)
        moments = np.array(moments).T
        inverse = np.linalg.pinv(moments / np.linalg.norm(moments, axis=1)[:, None])
        self.inputs = np.zeros((len(self.names), 3))
        self.inputs[gimbals] = np.array(stiffness)[:, None] * inverse / np.abs(inverse).max(0)

        shapes, self.sensors = at("shapes", time), {}
        for sensor in self.file["autopilot"]["sensor"]:
            slopes = shapes[shapes.grid == sensor["grid"]].set_index("label")
            kind = {"rate-gyro": "gyro", "attitude": "attitude"}[sensor["kind"]]
            for axis, letter in zip(AXES, "xyz"):
                row = np.zeros(len(self.names))
                row[self.names.index(f"theta.{letter}")] = 1
                for j, name in enumerate(self.names):
                    if name.startswith("eta."):
                        row[j] = slopes.loc[name[4:], f"psi_{letter}_rad_per_m_sqrt_kg"]
                self.sensors[f"{kind}.{sensor['name']}.{axis}"] = row

    def loop(self, hertz):
        """G(jω) with the exact delay."""
        s = 2j * np.pi * hertz
        m = self.matrices
        # Coordinates of unit mass: kilograms and modal coordinates in one matrix would cost digits.
        unit = 1 / np.sqrt(np.diag(m["M"]))
        scaled = (m["M"] * s**2 + m["D"] * s + m["K"]) * np.outer(unit, unit)
        x = unit[:, None] * np.linalg.solve(scaled, unit[:, None] * self.inputs)
        signals = {n: (s if n.startswith("gyro") else 1) * (row @ x) for n, row in self.sensors.items()}
        autopilot, loop = self.file["autopilot"], np.zeros((3, 3), complex)
        for path in autopilot["path"]:
            value = path.get("gain", 1.0) * sum(w * signals[n] for n, w in path["input"].items())
            for f in path.get("filter", []):
                value = value * filter_response(f, s)
            signals["path." + path["name"]] = value
            if "axis" in path:
                loop[AXES.index(path["axis"])] += value * np.exp(-s * autopilot["delay_s"])
        return loop


def drawn_stiffness(run, population, number, path):
    """The factor drawn on an actuator's stiffness."""
    scale, row = 1.0, run.cases.loc[(population, number)]
    for key, column in run.columns.items():
        written = key.split(" @ ")[0].split(".")
        same = len(written) == len(path.split(".")) and all(
            a in ("*", b) for a, b in zip(written, path.split("."))
        )
        if same and not pd.isna(row[column]):
            scale *= row[column]
    return scale


def filter_response(f, s):
    def quadratic(hertz, zeta):
        x = s / (2 * np.pi * hertz)
        return x**2 + 2 * zeta * x + 1

    if f["kind"] == "low-pass":
        return 1 / quadratic(f["frequency_hz"], f["damping"])
    assert f["kind"] == "notch"
    return quadratic(f["frequency_hz"], f["zero_damping"]) / quadratic(f["frequency_hz"], f["pole_damping"])


def broken(loop, axis):
    """The loop of an axis with the others closed."""
    others = [i for i in range(3) if i != axis]
    rest = np.eye(2) + loop[np.ix_(others, others)]
    return loop[axis, axis] - loop[axis, others] @ np.linalg.solve(rest, loop[others, axis])


def response(run, population, number, time, variant="on"):
    more = ["--population", population, "--case", number, "--time", time, "--variant", variant]
    return pd.read_csv(io.StringIO(tvse("response", run.folder, *more)))


def stored(table, population, number, variant, time):
    same = (table.population == population) & (table.case == number) & (table.variant == variant)
    return table[same & (table.flight_time_s == time)]


@pytest.mark.parametrize("time", TIMES)
def test_the_response_is_that_of_a_plant_assembled_here(loops, case, time):
    population, number, tables = case
    plant = Plant(loops, tables, population, number, time)
    table = response(loops, population, number, time)
    for axis, name in enumerate(AXES):
        rows = table[table.axis == name]
        assert len(rows) > 100
        for row in rows.iloc[:: len(rows) // 60].itertuples():
            expected = broken(plant.loop(row.frequency_hz), axis)
            # Light modes lose digits by their quality, 1/2ζ near 1e5 where damping nearly vanishes.
            assert abs(complex(row.re, row.im) - expected) <= 1e-6 * abs(expected) + 1e-9, row


def test_the_loop_of_the_wrong_sign_is_that_of_the_opposite_matrix(loops, case):
    population, number, tables = case
    plant = Plant(loops, tables, population, number, 105.0)
    table = response(loops, population, number, 105.0, "wrong")
    row = table[(table.axis == "roll") & (table.frequency_hz > 1)].iloc[0]
    expected = broken(-plant.loop(row.frequency_hz), 0)
    assert abs(complex(row.re, row.im) - expected) <= 1e-6 * abs(expected)


@pytest.mark.parametrize("time", TIMES)
def test_margins_are_those_of_the_curve_in_python_control(loops, case, time):
    population, number, _ = case
    table, margins = response(loops, population, number, time), loops.table("margins")
    for name in AXES:
        rows = table[table.axis == name]
        curve = (rows.re + 1j * rows.im).to_numpy()
        data = control.frd(curve, 2 * np.pi * rows.frequency_hz.to_numpy(), smooth=True)
        gains, phases, *_ = control.stability_margins(data, returnall=True)
        found = stored(margins, population, number, "on", time)
        row = found[found.axis == name].iloc[0]
        assert row.unstable_poles == 0
        decibel = 20 * np.log10(np.abs(gains))
        high, low = min(decibel[decibel > 0], default=40), min(-decibel[decibel <= 0], default=40)
        # python-control goes between the frequencies of the curve by splines.
        assert row.gain_margin_high_db == pytest.approx(min(high, 40), abs=0.05)
        assert row.gain_margin_low_db == pytest.approx(min(low, 40), abs=0.05)
        phase = np.abs((np.array(phases) + 180) % 360 - 180).min()
        assert row.phase_margin_deg == pytest.approx(phase, abs=0.5)
        disk = 2 / np.abs((1 - curve) / (1 + curve)).max()
        assert row.disk_margin == pytest.approx(disk, rel=0.02)
        assert row.disk_margin <= disk * (1 + 1e-9)


@pytest.mark.parametrize("variant", ["on", "wrong"])
def test_nyquists_count_is_the_number_of_unstable_poles_of_the_closed_model(loops, case, variant):
    population, number, tables = case
    poles, counts = tables["poles"], []
    for time in TIMES:
        found = poles[(poles.flight_time_s == time) & (poles.variant == variant) & (poles.pole_re_rad_s > 0)]
        counts.append(int((1 + (found.pole_im_rad_s > 0)).sum()))
        rows = stored(loops.table("margins"), population, number, variant, time)
        assert list(rows.unstable_poles) == [counts[-1]] * 3
        if counts[-1]:
            assert (rows.gain_margin_high_db == 0).all() and (rows.disk_margin == 0).all()
    assert all(counts) if variant == "wrong" else not any(counts)


def test_cases_hold_the_worst_over_the_flight_times(loops):
    groups = loops.table("margins").groupby(["population", "case", "variant", "axis"], observed=True)
    for (population, number, variant, axis), rows in groups:
        row = loops.cases.loc[(population, number)]
        for stem, suffix in [("gain_margin_low", "_db"), ("phase_margin", "_deg"), ("disk_margin", "")]:
            assert row[f"{stem}_min_{variant}_{axis}{suffix}"] == rows[stem + suffix].min()


def test_the_nominal_vehicle_has_the_margins_of_a_launch_vehicle(loops):
    row = loops.cases.loc[("nominal", 0)]
    for axis in AXES:
        assert row[f"gain_margin_low_min_on_{axis}_db"] >= 6
        assert row[f"gain_margin_high_min_on_{axis}_db"] >= 6
        assert row[f"phase_margin_min_on_{axis}_deg"] >= 30
        assert row[f"modes_not_stabilised_on_{axis}"] == 0


def test_envelopes_are_those_of_the_stored_curves(loops):
    keys = ["population", "variant", "flight_time_s", "axis", "frequency_hz"]
    curves, envelopes = loops.table("loop_curves"), loops.table("envelopes")
    nominal = curves[curves.population == "nominal"].set_index(keys[1:]).phase_deg
    groups = dict(list(curves.groupby(keys, observed=True)))
    assert len(groups) == len(envelopes) > 0
    for row in envelopes.itertuples():
        key = tuple(getattr(row, k) for k in keys)
        found = groups[key]
        phase = found.phase_deg - 360 * np.round((found.phase_deg - nominal.loc[key[1:]]) / 360)
        assert row.cases == len(found)
        for quantity, unit, values in [("magnitude", "db", found.magnitude_db), ("phase", "deg", phase)]:
            expected = {"min": values.min(), "p50": np.quantile(values, 0.5), "max": values.max()}
            for name, value in expected.items():
                assert getattr(row, f"{quantity}_{name}_{unit}") == pytest.approx(value, rel=1e-12, abs=1e-9)
