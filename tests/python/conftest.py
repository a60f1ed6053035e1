"""Small campaigns in a temporary folder, made by the program under test ($TVSE)."""

import functools
import json
import os
import shutil
import subprocess
import tomllib
from pathlib import Path

import pandas as pd
import pytest

import oracle

ROOT = Path(__file__).parents[2]
TVSE = Path(os.environ.get("TVSE", ROOT / "target/release/tvse")).resolve()


def pytest_sessionfinish(session):
    """A test that was skipped has shown nothing."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if reporter.stats.get("skipped"):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def tvse(*arguments):
    """Standard output of the program; it must succeed."""
    done = subprocess.run([TVSE, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout


class Run:
    """A finished run: its tables, its draws by key, its replays."""

    def __init__(self, folder):
        self.folder = folder
        self.manifest = json.loads((folder / "manifest.json").read_text())
        self.definition = self.manifest["run"]["definition"]
        inputs = {Path(i["name"]).name: folder / "inputs" / i["name"] for i in self.manifest["run"]["inputs"]}
        self.vehicle = oracle.Vehicle(inputs["vehicle.toml"].parent)
        dispersion = self.manifest["run"]["inputs"][2]["name"]
        self.dispersion = tomllib.loads((folder / "inputs" / dispersion).read_text())
        self.draws = oracle.draws(self.vehicle, self.dispersion)
        self.columns = {d["key"]: d["column"] for d in self.manifest["run"]["draws"]}
        self.variants = {v["name"]: v for v in self.definition["variants"]}
        flags = self.definition["gimballed"]
        self.gimballed = [e for e, moves in zip(self.vehicle.engines, flags) if moves]
        self.cases = self.table("cases").set_index(["population", "case"])

    @functools.cache
    def table(self, name):
        return pd.read_parquet(self.folder / "tables" / f"{name}.parquet")

    def case(self, population, case):
        row = self.cases.loc[(population, case)]
        values = {key: row[column] for key, column in self.columns.items()}
        return oracle.Case(self.draws, values)

    def model(self, population, case, time, variant, **factors):
        drawn = self.case(population, case)
        return oracle.assemble(
            self.vehicle, time, self.variants[variant], self.gimballed, drawn, **factors
        )

    def replay(self, population, case, folder):
        text = tvse("replay", self.folder, "--population", population, "--case", case, "-o", folder)
        assert "bit for bit" in text
        return {name: pd.read_parquet(folder / f"{name}.parquet") for name in ["matrices", "poles", "vectors"]}


VARIANTS = {
    "no_jet_damping": 'case_jet_damping = false\nnozzle_jet_damping = "off"',
    "case_only": 'case_jet_damping = true\nnozzle_jet_damping = "off"',
    "jet_damping": 'case_jet_damping = true\nnozzle_jet_damping = "equation-13"',
    "rigid_nozzle": 'case_jet_damping = true\nnozzle_jet_damping = "rigid-nozzle"',
    "follower": 'case_jet_damping = true\nnozzle_jet_damping = "equation-13"\nfollower_thrust = true',
    "single_grid": 'case_jet_damping = true\nnozzle_jet_damping = "equation-13"\nslope = "single-grid"',
    "thrust_off": 'thrust = false\ncase_jet_damping = true\nnozzle_jet_damping = "rigid-nozzle"',
}


def run_file(vehicle, dispersion, cases, times, gimballed, variants=VARIANTS, more=""):
    texts = [f'[[variant]]\nname = "{name}"\n{VARIANTS[name]}\n' for name in variants]
    return "\n".join(
        [
            f'vehicle = "{vehicle}"\ndispersion = "{dispersion}"\ncases = {cases}\nseed = 7',
            f"flight_times_s = {times}",
            f'modes = ["tvse"]\ngimballed = {json.dumps(gimballed)}',
            *texts,
            more,
        ]
    )


REFERENCE = ("vehicles/sls-like", "dispersions/reference.toml")

CORNER = """
[[corner]]
name = "adverse"
cases = 3
signs = "evaluated"
mode = "tvse"
variant = "jet_damping"
keys = ["modes.m00*.damping", "booster.*.thrust", "booster.*.nozzle.*", "booster.*.actuator.*.damping"]
"""


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """Makes a run from the text of a run file, once, beside copies of the reference vehicle."""
    folder = tmp_path_factory.mktemp("runs")
    for inputs in ["vehicles", "dispersions"]:
        shutil.copytree(ROOT / inputs, folder / inputs)

    def make(name, text):
        target = folder / name
        if not target.exists():
            (folder / f"{name}.toml").write_text(text)
            tvse("run", folder / f"{name}.toml", "-o", target)
        return Run(target)

    make.folder = folder
    return make


@pytest.fixture(scope="session")
def smoke(tmp_path_factory):
    """The shipped smoke run."""
    folder = tmp_path_factory.mktemp("smoke") / "run"
    tvse("run", ROOT / "runs/smoke.toml", "-o", folder)
    return Run(folder)


@pytest.fixture(scope="session")
def boosters(runs):
    """Boosters gimballed, every variant, three flight times, a corner."""
    text = run_file(*REFERENCE, 4, [80.0, 105.0, 112.0], ["booster.*"], more=CORNER)
    return runs("boosters", text)


@pytest.fixture(scope="session")
def all_engines(runs):
    """All six engines gimballed."""
    variants = ["no_jet_damping", "rigid_nozzle"]
    return runs("all_engines", run_file(*REFERENCE, 3, [110.0], ["*.*"], variants))


@pytest.fixture(scope="session")
def left_alone(runs):
    """One booster and the core gimballed, the other booster locked."""
    text = run_file(*REFERENCE, 2, [100.0], ["booster.left", "core.*"], ["rigid_nozzle"])
    return runs("left_alone", text)


# What makes the left booster of the skewed vehicle unlike any other: canted thrust, oblique action
# lines, given axes, one separate bearing, a throat ahead of the gimbal. Each is replaced once.
SKEW = [
    (
        "thrust_direction = [-1.0, 0.0, 0.0]",
        "thrust_direction = [-0.9799603124110048, 0.11999514029522508, -0.15899356089117325]\n"
        "axes = [[0.06115040622432118, 0.9408740118620889, 0.3331917190164522],\n"
        "        [0.1895742965645039, 0.31679214022457564, -0.9293569421777654]]\n"
        'throat_grid = "booster.left.aft.02"',
    ),
    ("action_line = [1.0, 0.0, 0.0]", "action_line = [0.95, 0.2, 0.24]"),
    ("action_line = [1.0, 0.0, 0.0]", "action_line = [0.97, -0.15, 0.19]"),
    ('bearing = "included"', 'bearing = "separate"'),
    ("stiffness_n_m_rad = 2.0e6", "damping_n_m_s_rad = 3.0e4\nstiffness_n_m_rad = 2.0e6"),
    ('name = "rock"', 'name = "rock"\nattach_m = [-0.4, -1.1, 1.5]'),
]


@pytest.fixture(scope="session")
def skewed(runs):
    """A vehicle without symmetry under every law, level and way of applying a draw."""
    folder = runs.folder / "vehicles/skewed"
    if not folder.exists():
        shutil.copytree(ROOT / "vehicles/sls-like", folder)
        head, left, rest = (folder / "vehicle.toml").read_text().split("[[engine]]\n", 2)
        for found, instead in SKEW:
            assert found in left
            left = left.replace(found, instead, 1)
        (folder / "vehicle.toml").write_text("[[engine]]\n".join([head, left, rest]))
        shutil.copy(Path(__file__).with_name("skewed.toml"), runs.folder / "dispersions")
    text = run_file(
        "vehicles/skewed",
        "dispersions/skewed.toml",
        4,
        [95.0, 114.0],
        ["booster.*", "core.2"],
        ["no_jet_damping", "rigid_nozzle", "follower", "single_grid"],
    )
    return runs("skewed", text)
