"""Certified poles against poles in 50 digits; the two solvers against each other."""

import shutil

import mpmath
import numpy as np
import pandas as pd
import pytest

from conftest import ROOT, tvse

DIGITS = 50
KEY = ["population", "case", "variant", "flight_time_s"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A small reference campaign with every pole, audited."""
    folder = tmp_path_factory.mktemp("spectrum") / "run"
    out = tvse("run", ROOT / "runs/reference.toml", "--cases", 6, "--poles", "all", "--audit", 4, "--output", folder)
    assert ": agreed" in out
    return folder


def refined(entries, pole, gap):
    """The pole in many digits: root of the Rayleigh functional with vectors in double precision, whose errors enter
    by their product; and the size of that product."""
    m, d, k = entries
    pencil = pole * pole * m + pole * d + k
    scale = 1 / np.sqrt(np.abs(np.diag(m)) * abs(pole) ** 2 + np.abs(np.diag(k)))
    u, _, vh = np.linalg.svd(scale[:, None] * pencil * scale)
    left, right = np.conj(u[:, -1]) * scale, np.conj(vh[-1]) * scale
    with mpmath.workdps(DIGITS):
        exact = lambda a: mpmath.matrix(a.tolist())
        y, x = exact(left[None, :]), exact(right[:, None])
        forms = [(y * exact(a) * x)[0] for a in (m, d, k)]
        s = mpmath.mpc(pole)
        for _ in range(6):
            s -= (forms[0] * s * s + forms[1] * s + forms[2]) / (2 * forms[0] * s + forms[1])
        off = abs(s - mpmath.mpc(pole))
    return float(off), (1e-15 * abs(pole) / gap) ** 2 * gap


def matrices(entries):
    """M, D and K of the rows of `matrices.parquet` of one model."""
    size = 1 + int(entries[entries["matrix"] == "K"]["row"].max())
    found = []
    for name in "MDK":
        matrix = np.zeros((size, size))
        one = entries[entries["matrix"] == name]
        matrix[one["row"].astype(int), one["column"].astype(int)] = one["value"]
        found.append(matrix)
    return found


def test_poles_are_within_their_bounds_of_poles_in_fifty_digits(folder):
    modes = pd.read_parquet(folder / "tables/modes.parquet")
    assert (modes["certificate"] == "discs").all() and (modes["solver"] == "structured").all()
    case = 3
    replay = folder / "replay"
    tvse("replay", folder, "--case", case, "--output", replay)
    entries = pd.read_parquet(replay / "matrices.parquet")
    checked = 0
    for variant in ["no_jet_damping", "jet_damping"]:
        rows = modes[(modes["population"] == "dispersed") & (modes["case"] == case)]
        rows = rows[(rows["variant"] == variant) & (rows["flight_time_s"] == 105.0)]
        found = entries[(entries["variant"] == variant) & (entries["flight_time_s"] == 105.0)]
        m, d, k = matrices(found)
        size = len(m)
        poles = rows["pole_re_rad_s"].to_numpy() + 1j * rows["pole_im_rad_s"].to_numpy()
        bounds = rows["pole_error_bound_rad_s"].to_numpy()
        assert len(poles) == size and (bounds < 1e-10 * np.abs(poles)).all()
        for index, pole in enumerate(poles):
            gap = np.abs(np.delete(poles, index) - pole).min()
            off, uncertain = refined((m, d, k), pole, gap)
            assert off <= bounds[index] + uncertain, (variant, pole, off, bounds[index])
            checked += 1
    assert checked >= 50


def test_both_solvers_find_the_same_poles(folder, tmp_path):
    tvse("run", ROOT / "runs/reference.toml", "--cases", 6, "--solver", "dense", "--output", tmp_path / "dense")
    dense = pd.read_parquet(tmp_path / "dense/tables/modes.parquet")
    assert (dense["certificate"] == "residual").all() and (dense["determinants"] == 0).all()
    ours = pd.read_parquet(folder / "tables/modes.parquet")
    ours = ours[ours["mode"].notna()]
    both = ours.merge(dense, on=[*KEY, "mode", "branch"], suffixes=("", "_dense"))
    assert len(both) == len(ours) == len(dense)
    assert (np.abs(both["damping_ratio"] - both["damping_ratio_dense"]) < 1e-10).all()
    off = np.hypot(both["pole_re_rad_s"] - both["pole_re_rad_s_dense"], both["pole_im_rad_s"] - both["pole_im_rad_s_dense"])
    assert (off <= both["pole_error_bound_rad_s"] + 2 * both["pole_error_bound_rad_s_dense"] + 1e-11).all()


def test_a_replay_uses_the_solver_of_the_run(folder):
    assert "bit for bit as stored" in tvse("replay", folder, "--case", 1)


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """The reference vehicle with sixty modes at one time: elastic coordinates are eliminated in closed form."""
    root = tmp_path_factory.mktemp("many")
    shutil.copytree(ROOT / "vehicles/sls-like", root / "vehicle")
    tvse("modes", root / "vehicle/stick.toml", "-o", root / "vehicle/modes", "--force", "--count", 60)
    shutil.copy(ROOT / "dispersions/reference.toml", root / "reference.toml")
    (root / "run.toml").write_text("""
vehicle = "vehicle"
dispersion = "reference.toml"
cases = 8
seed = 7
flight_times_s = [105.0]
modes = ["tvse"]
gimballed = ["booster.*"]

[[variant]]
name = "no_jet_damping"
case_jet_damping = false
nozzle_jet_damping = "off"

[[variant]]
name = "jet_damping"
case_jet_damping = true
nozzle_jet_damping = "equation-13"
""")
    out = tvse("run", root / "run.toml", "--poles", "all", "--audit", 6, "--output", root / "run")
    assert ": agreed" in out
    return root


def test_many_modes_are_proven_by_discs_and_with_the_full_jet_matrix_by_residuals(many):
    modes = pd.read_parquet(many / "run/tables/modes.parquet")
    assert (modes["solver"] == "structured").all()
    proven = modes.groupby("variant")["certificate"].unique().map(list).to_dict()
    assert proven == {"no_jet_damping": ["discs"], "jet_damping": ["residual"]}
    tvse("replay", many / "run", "--case", 5, "--output", many / "replay")
    entries = pd.read_parquet(many / "replay/matrices.parquet")
    for variant in ["no_jet_damping", "jet_damping"]:
        rows = modes[(modes["population"] == "dispersed") & (modes["case"] == 5) & (modes["variant"] == variant)]
        poles = rows["pole_re_rad_s"].to_numpy() + 1j * rows["pole_im_rad_s"].to_numpy()
        bounds = rows["pole_error_bound_rad_s"].to_numpy()
        m, d, k = matrices(entries[entries["variant"] == variant])
        assert len(poles) == len(m) == 64 and (bounds < 1e-10 * np.abs(poles)).all()
        for index in range(0, 64, 3):
            gap = np.abs(np.delete(poles, index) - poles[index]).min()
            off, uncertain = refined((m, d, k), poles[index], gap)
            assert off <= bounds[index] + uncertain, (variant, poles[index], off, bounds[index])
        # Sum of the poles, which no other set of poles has.
        trace = -np.trace(np.linalg.solve(m, d))
        assert abs(2 * poles.real.sum() - trace) < 1e-11 * abs(trace)
        # Participation adds up to one, with vectors from the structure.
        parts = [c for c in rows.columns if c.startswith("participation_")]
        assert np.abs(rows[parts].sum(axis=1) - 1).max() < 1e-8


def test_repeated_poles_stay_what_they_are_under_the_full_jet_matrix(many):
    # Four equal engines on one ring: poles of their own to which no mode answers.
    text = (many / "run.toml").read_text().replace('["booster.*"]', '["*.*"]').replace("cases = 8", "cases = 3")
    (many / "six.toml").write_text(text)
    out = tvse("run", many / "six.toml", "--poles", "all", "--audit", 4, "--output", many / "six")
    assert ": agreed" in out
    modes = pd.read_parquet(many / "six/tables/modes.parquet")
    assert (modes["solver"] == "structured").all()
    proven = modes.groupby("variant")["certificate"].unique().map(list).to_dict()
    assert proven["jet_damping"] == ["residual"]


def test_a_package_with_as_many_modes_as_its_stick_gives_is_taken(many):
    tvse("modes", many / "vehicle/stick.toml", "-o", many / "short/modes", "--count", 236)
    shutil.copytree(many / "vehicle", many / "short", dirs_exist_ok=True, ignore=shutil.ignore_patterns("modes"))
    text = (many / "run.toml").read_text().replace('"vehicle"', '"short"').replace("cases = 8", "cases = 1")
    (many / "short.toml").write_text(text)
    tvse("run", many / "short.toml", "--output", many / "short_run")
    modes = pd.read_parquet(many / "short_run/tables/modes.parquet")
    proven = modes.groupby("variant")["certificate"].unique().map(list).to_dict()
    assert proven == {"no_jet_damping": ["discs"], "jet_damping": ["near"]}


def test_poles_near_the_modes_of_interest_are_those_of_all(many):
    out = tvse("run", many / "run.toml", "--audit", 3, "--output", many / "near")
    assert ": agreed" in out
    near = pd.read_parquet(many / "near/tables/modes.parquet")
    proven = near.groupby("variant")["certificate"].unique().map(list).to_dict()
    assert proven == {"no_jet_damping": ["discs"], "jet_damping": ["near"]}
    key = ["population", "case", "variant", "mode", "branch"]
    every = pd.read_parquet(many / "run/tables/modes.parquet").dropna(subset="mode")
    both = near.merge(every, on=key, suffixes=("", "_all"), validate="1:1")
    assert len(both) == len(near) and (both["null_poles"] == both["null_poles_all"]).all()
    off = np.hypot(both["pole_re_rad_s"] - both["pole_re_rad_s_all"], both["pole_im_rad_s"] - both["pole_im_rad_s_all"])
    assert (off <= both["pole_error_bound_rad_s"] + both["pole_error_bound_rad_s_all"]).all()
    assert (both["identity_confidence"] - both["identity_confidence_all"]).abs().max() < 1e-9
    assert "bit for bit as stored" in tvse("replay", many / "near", "--case", 5)


def test_margins_through_the_interface_are_those_of_the_state_space(many):
    # Without the case jet matrix and with many modes, responses of a structured run do not come from a state space.
    tvse("modes", many / "vehicle/stick.toml", "-o", many / "loops/modes", "--count", 98)
    shutil.copytree(many / "vehicle", many / "loops", dirs_exist_ok=True, ignore=shutil.ignore_patterns("modes"))
    shutil.copy(ROOT / "dispersions/closed-loop.toml", many / "loops.dispersion.toml")
    (many / "loops.toml").write_text("""
vehicle = "loops"
dispersion = "loops.dispersion.toml"
cases = 3
seed = 7
flight_times_s = [105.0]
modes = ["tvse"]
gimballed = ["booster.*"]

[margins]
variants = ["closed"]

[[variant]]
name = "closed"
case_jet_damping = false
nozzle_jet_damping = "equation-13"
rigid_body = true
slosh = true
aerodynamics = true
feedback = "closed"
""")
    tables = []
    for solver in ("structured", "dense"):
        tvse("run", many / "loops.toml", "--solver", solver, "--output", many / f"loops_{solver}")
        tables.append(pd.read_parquet(many / f"loops_{solver}/tables/margins.parquet"))
    ours, theirs = tables
    assert len(ours) == len(theirs) == 12 and not ours.equals(theirs)
    for name, allowed in [("phase_margin_deg", 1e-6), ("gain_margin_high_db", 1e-7), ("delay_margin_s", 1e-9)]:
        assert ours[name].notna().any() and (ours[name].isna() == theirs[name].isna()).all()
        assert (ours[name] - theirs[name]).abs().max() < allowed, name


def test_many_modes_give_the_same_bytes_for_any_number_of_threads(many):
    for jobs in (1, 2):
        tvse("run", many / "run.toml", "--jobs", jobs, "--output", many / f"jobs{jobs}")
    one, two = (many / f"jobs{jobs}/tables/modes.parquet" for jobs in (1, 2))
    assert one.read_bytes() == two.read_bytes()
    assert "bit for bit as stored" in tvse("replay", many / "jobs1", "--case", 3)
