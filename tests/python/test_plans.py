"""Plans and statistics against scipy, OpenTURNS and mappings written out again."""

import csv
import io
import json
import subprocess
from pathlib import Path

import numpy as np
import openturns as ot
import pandas as pd
import pyarrow.parquet as parquet
import pytest
import scipy.stats
from blake3 import blake3
from scipy.special import ndtr, ndtri

from conftest import ROOT, TVSE, run_file, tvse
from test_draws import uniform

MASK = 2**64 - 1

ROW = """
[[row]]
path = "{path}"
level = "{level}"
apply = "scale"
source = "test"
law = {{ kind = "{kind}", {arguments} }}
worst = [0.8, 1.2]
class = "{known}"
"""
NORMAL = ("normal", "mean = 1.0, sigma = 0.05")
UNIFORM = ("uniform", "low = 0.9, high = 1.1")
ROWS = [
    ("modes.*.damping", "vehicle", *UNIFORM, "unknown"),
    ("booster.*.thrust", "engine", *NORMAL, "flight_day"),
    ("booster.*.nozzle.mass", "engine", *NORMAL, "vehicle"),
    ("booster.*.nozzle.inertia", "engine", *UNIFORM, "vehicle"),
]
KEYS = [
    "modes.*.damping @ vehicle",
    "booster.left.thrust @ engine",
    "booster.right.thrust @ engine",
    "booster.left.nozzle.mass @ engine",
    "booster.right.nozzle.mass @ engine",
    "booster.left.nozzle.inertia @ engine",
    "booster.right.nozzle.inertia @ engine",
]
GROUP = [KEYS[3], KEYS[5], KEYS[4]]
MATRIX = np.array([[1.0, 0.7, -0.3], [0.7, 1.0, 0.2], [-0.3, 0.2, 1.0]])
CORRELATION = f"""
[[correlation]]
kind = "rank"
keys = {json.dumps(GROUP)}
matrix = {json.dumps(MATRIX.tolist())}
source = "test"
"""


@pytest.fixture(scope="module")
def folder(runs):
    rows = [ROW.format(path=p, level=l, kind=k, arguments=a, known=c) for p, l, k, a, c in ROWS]
    (runs.folder / "dispersions/small.toml").write_text("".join(rows))
    (runs.folder / "dispersions/correlated.toml").write_text("".join(rows) + CORRELATION)
    return runs.folder


def scenario(dispersion, cases, plan):
    text = run_file(
        "vehicles/sls-like", f"dispersions/{dispersion}.toml", cases, [110.0], ["booster.*"],
        ["no_jet_damping", "jet_damping"], more=f"\n[plan]\n{plan}\n",
    )
    return text if cases else text.replace("cases = None\n", "")


def draws(folder, dispersion, cases, plan):
    """Values and scores of `tvse plan` by key and case, and the seed."""
    (folder / "p.toml").write_text(scenario(dispersion, cases, plan))
    target = folder / "p.parquet"
    target.unlink(missing_ok=True)
    tvse("plan", folder / "p.toml", "-o", target)
    table = pd.read_parquet(target)
    table = table[table.population == "dispersed"].set_index("case")
    outline = json.loads(parquet.read_metadata(target).metadata[b"tvse.run"])
    columns = {d["key"]: d["column"] for d in outline["draws"]}
    values = {key: table[column].to_numpy() for key, column in columns.items()}
    scores = {key: table["z_" + column[5:]].to_numpy() for key, column in columns.items()}
    return values, scores, outline["definition"]["seed"], table


# ------------------------------------------------------------------ plans


def finish(word):
    word = (word ^ word >> 30) * 0xBF58476D1CE4E5B9 & MASK
    word = (word ^ word >> 27) * 0x94D049BB133111EB & MASK
    return word ^ word >> 31


def keyed(context, seed, replicate, name):
    """The keyed hash of numbers."""
    message = b"".join(n.to_bytes(8, "little") for n in (seed, replicate, len(name.encode()))) + name.encode()
    digest = blake3(message, derive_key_context=context).digest()
    words = [int.from_bytes(digest[i : i + 8], "little") for i in range(0, 32, 8)]

    def hash_of(number):
        for word in words:
            number = finish(number + word & MASK)
        return number

    return hash_of


def scrambled(point, coins):
    """Owen's scrambling, digit by digit: 52 digits of a point of 64."""
    result = 0
    for digit in range(52):
        block, level = divmod(digit, 6)
        above = point >> 64 - 6 * block
        inside = point >> 64 - digit & (1 << level) - 1 if level else 0
        node = (1 << level) + inside
        coin = coins(above << 4 | block) >> node & 1
        result = result << 1 | (point >> 63 - digit & 1) ^ coin
    return result


def test_the_packed_direction_numbers_are_those_that_scipy_ships():
    table = np.load(Path(scipy.stats.__path__[0]) / "_sobol_direction_numbers.npz")
    text = (ROOT / "src/dispersion/sobol/joe_kuo_6.bin").read_bytes()
    bits = "".join(f"{byte:08b}" for byte in text)
    at = 0
    for polynomial, numbers in zip(table["poly"][1:4096], table["vinit"][1:4096]):
        degree = int(polynomial).bit_length() - 1
        for i in range(degree):
            width = degree - 1 if i == 0 else i
            found = int(bits[at : at + width] or "0", 2)
            at += width
            expected = polynomial >> 1 & (1 << degree - 1) - 1 if i == 0 else numbers[i] // 2
            assert found == expected
    assert 0 <= len(bits) - at < 8


@pytest.mark.parametrize("replicates", [1, 4])
def test_sobol_draws_are_the_points_of_scipy_scrambled_as_documented(folder, replicates):
    plan = f'kind = "sobol"\nreplicates = {replicates}'
    _, scores, seed, _ = draws(folder, "small", 128, plan)
    sequence = scipy.stats.qmc.Sobol(len(KEYS), scramble=False, bits=64)
    points = sequence.random(128 // replicates)
    for dimension, key in enumerate(KEYS):
        hashes = [keyed("tvse sobol v1", seed, r, key) for r in range(replicates)]
        for case in range(128):
            point = int(points[case // replicates, dimension] * 2**64)
            expected = (2 * scrambled(point, hashes[case % replicates]) + 1) / 2**53
            # Through Φ⁻¹ and back: a few roundings.
            assert ndtr(scores[key][case]) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("dispersion", ["small", "correlated"])
@pytest.mark.parametrize("cases, replicates", [(60, 1), (60, 3), (3000, 1)])
def test_every_stratum_of_a_latin_hypercube_holds_one_case(folder, dispersion, cases, replicates):
    plan = f'kind = "latin_hypercube"\nreplicates = {replicates}'
    _, scores, _, table = draws(folder, dispersion, cases, plan)
    points = cases // replicates
    if replicates > 1:
        assert (table.replicate == np.arange(cases) % replicates).all()
    for key in KEYS:
        for replicate in range(replicates):
            strata = np.floor(ndtr(scores[key][replicate::replicates]) * points).astype(int)
            assert (np.sort(strata) == np.arange(points)).all()


def test_a_hypercube_has_the_discrepancy_of_one_and_sobol_less_than_independent_draws(folder):
    found = {}
    for kind in ["monte_carlo", "latin_hypercube", "sobol"]:
        _, scores, _, _ = draws(folder, "small", 1024, f'kind = "{kind}"')
        uniforms = ndtr(np.column_stack([scores[key] for key in KEYS]))
        found[kind] = scipy.stats.qmc.discrepancy(uniforms, method="CD")
    assert found["sobol"] < found["latin_hypercube"] < found["monte_carlo"]


def test_correlated_scores_are_the_cholesky_factor_times_the_independent_ones(folder):
    _, scores, seed, _ = draws(folder, "correlated", 40, 'kind = "monte_carlo"')
    matrix = ot.CorrelationMatrix(3, MATRIX.ravel())
    normal = np.array(ot.NormalCopula.GetCorrelationFromSpearmanCorrelation(matrix))
    assert np.allclose(normal, 2 * np.sin(np.pi * MATRIX / 6), rtol=0, atol=1e-12)
    factor = np.linalg.cholesky(normal)
    for case in range(40):
        independent = ndtri([uniform(seed, key, case) for key in GROUP])
        found = [scores[key][case] for key in GROUP]
        assert found == pytest.approx(factor @ independent, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("kind", ["monte_carlo", "latin_hypercube", "sobol"])
def test_copulas_give_the_stated_rank_correlations_and_keep_margins(folder, kind):
    """Spearman within 5/√4096; each margin passes Kolmogorov at one in a million."""
    values, scores, _, _ = draws(folder, "correlated", 4096, f'kind = "{kind}"')
    found = scipy.stats.spearmanr(np.column_stack([values[key] for key in GROUP])).statistic
    assert np.abs(found - MATRIX).max() < 5 / 64
    others = scipy.stats.spearmanr(values[KEYS[3]], values[KEYS[1]]).statistic
    assert abs(others) < 5 / 64
    for key in KEYS:
        assert scipy.stats.kstest(scores[key], "norm").pvalue > 1e-6


def test_a_matrix_that_is_not_positive_definite_names_the_pair(folder):
    text = (folder / "dispersions/correlated.toml").read_text().replace("0.2", "-0.9")
    (folder / "dispersions/bad.toml").write_text(text)
    (folder / "bad.toml").write_text(scenario("bad", 10, 'kind = "sobol"'))
    done = subprocess.run([TVSE, "check", folder / "bad.toml"], capture_output=True, text=True)
    assert done.returncode == 2
    assert "correlation[0].matrix[" in done.stderr and "not positive definite" in done.stderr
    assert "nozzle" in done.stderr and "< r <" in done.stderr


def test_cases_of_a_file_are_drawn_as_they_are_and_kept_with_the_run(folder, runs):
    values, scores, _, _ = draws(folder, "small", 6, 'kind = "monte_carlo"')
    for kind, columns in [("value", values), ("normal_score", scores)]:
        frame = pd.DataFrame(columns)
        for name, write in [("plan.csv", frame.to_csv), ("plan.parquet", frame.to_parquet)]:
            write(folder / name, index=False)
            plan = f'kind = "file"\npath = "{name}"\ncolumns = "{kind}"'
            found, _, _, _ = draws(folder, "small", None, plan)
            for key in KEYS:
                assert found[key] == pytest.approx(values[key], rel=0 if kind == "value" else 1e-12)
    run = runs("from_file", scenario("small", None, 'kind = "file"\npath = "plan.csv"\ncolumns = "normal_score"'))
    digests = {entry["name"]: entry["blake3"] for entry in run.manifest["run"]["inputs"]}
    assert digests["plan.csv"] == blake3((folder / "plan.csv").read_bytes()).hexdigest()
    assert (run.folder / "inputs/plan.csv").read_bytes() == (folder / "plan.csv").read_bytes()
    (folder / "plan.csv").unlink()
    run.replay("dispersed", 3, folder / "replayed")


# ------------------------------------------------------------------ statistics


def test_sample_sizes_are_those_of_openturns():
    for coverage, risk in [(0.95, 0.05), (0.99, 0.1), (0.9973, 0.1)]:
        for exceedances in range(4):
            text = tvse("how-many", "--coverage", coverage, "--risk", risk, "--exceedances", exceedances)
            expected = ot.Wilks.ComputeSampleSize(coverage, 1 - risk, exceedances)
            assert f"| {expected} |" in " ".join(text.split())


@pytest.fixture(scope="module")
def small(runs, folder):
    return runs("small_monte_carlo", scenario("small", 300, 'kind = "monte_carlo"'))


METRIC = "damping_ratio_min_jet_damping_tvse"


def lines(*arguments):
    """A CSV that a command writes, as rows by name."""
    target = Path(arguments[-1])
    target.unlink(missing_ok=True)
    tvse(*arguments)
    return list(csv.DictReader(io.StringIO(target.read_text())))


def test_intervals_of_independent_cases_are_those_of_scipy(small):
    summary = small.table("summary")
    of = (summary.population == "dispersed") & summary.flight_time_s.isna() & (summary.variant == "jet_damping")
    row = summary[of].iloc[0]
    values = small.table("cases").query("population == 'dispersed'")[METRIC].to_numpy()
    n, ordered = len(values), np.sort(values)
    assert row.intervals == "independent_cases"
    low, high = scipy.stats.ttest_1samp(values, 0).confidence_interval(0.95)
    assert (row.damping_ratio_mean_low, row.damping_ratio_mean_high) == pytest.approx((low, high), rel=1e-9)
    median = scipy.stats.quantile_test(values, p=0.5).confidence_interval(0.95)
    found = (row.damping_ratio_p50_low, row.damping_ratio_p50_high)
    assert found == pytest.approx((median.low, median.high), rel=1e-12)
    # 0.99^300 = 0.049 is beyond half the risk: no lower bound of the first percentile.
    assert np.isnan(row.damping_ratio_p1_low) and ordered[0] < row.damping_ratio_p1_high < ordered[20]
    baseline = small.table("cases").query("population == 'dispersed'")
    gain = values - baseline["damping_ratio_min_no_jet_damping_tvse"].to_numpy()
    low, high = scipy.stats.ttest_1samp(gain, 0).confidence_interval(0.95)
    found = (row.damping_ratio_gain_mean_low, row.damping_ratio_gain_mean_high)
    assert found == pytest.approx((low, high), rel=1e-9)


def test_bootstrap_intervals_agree_with_scipys(small, folder):
    """Ends within a tenth of the width: two bootstraps of 4000 resamples differ by a few hundredths."""
    rows = lines("statistics", small.folder, "--metric", METRIC, "--resamples", 4000, "-o", folder / "s.csv")
    values = small.table("cases").query("population == 'dispersed'")[METRIC].to_numpy()
    statistics = {
        "mean": np.mean,
        "sd": lambda x, axis: np.std(x, ddof=1, axis=axis),
        "skewness": scipy.stats.skew,
        "p50": np.median,
    }
    for name, of in statistics.items():
        row = next(r for r in rows if r["statistic"] == name and r["interval by"] == "bootstrap_bca")
        found = scipy.stats.bootstrap((values,), of, n_resamples=4000, method="BCa", rng=1, vectorized=True)
        low, high = found.confidence_interval
        assert float(row["low"]) == pytest.approx(low, abs=0.1 * (high - low))
        assert float(row["high"]) == pytest.approx(high, abs=0.1 * (high - low))
    last = [r for r in rows if r["statistic"] == "share"][-1]
    events = int((values < 0).sum())
    low, high = scipy.stats.binomtest(events, len(values)).proportion_ci(0.95, "exact")
    assert (float(last["low"]), float(last["high"])) == pytest.approx((low, high), rel=1e-9)


def test_regression_and_partial_ranks_are_those_of_openturns(small, folder):
    rows = lines("sensitivity", small.folder, "--metric", METRIC, "-o", folder / "r.csv")
    cases = small.table("cases").query("population == 'dispersed'")
    x = ot.Sample(np.ascontiguousarray(cases[[small.columns[key] for key in KEYS]].to_numpy()))
    y = ot.Sample(cases[[METRIC]].to_numpy())
    analysis = ot.CorrelationAnalysis(x, y)
    for name, expected in [("src", analysis.computeSRC()), ("prcc", analysis.computePRCC())]:
        for key, value in zip(KEYS, expected):
            row = next(r for r in rows if r["key"] == key)
            assert float(row[name]) == pytest.approx(value, abs=1e-8)
            assert float(row[name + "_low"]) < value < float(row[name + "_high"])
    strength = [abs(float(r["src"])) for r in rows]
    assert strength == sorted(strength, reverse=True)
    low = cases[small.columns[rows[0]["key"]]].to_numpy()
    chosen = low <= np.quantile(low, 0.1)
    assert float(rows[0]["at_low"]) == pytest.approx(cases[METRIC].to_numpy()[chosen].mean(), rel=1e-9)


def between_bins(x, y):
    """First-order index by bins of equal count: their share of the variance less that of chance."""
    n = len(y)
    bins = round(2 * np.sqrt(n))
    label = np.floor((scipy.stats.rankdata(x) - 0.5) * bins / n).astype(int)
    groups = [y[label == b] for b in range(bins)]
    anova = scipy.stats.f_oneway(*groups).statistic
    within = sum(((g - g.mean()) ** 2).sum() for g in groups)
    between = anova * (bins - 1) * within / (n - bins)
    return (between - (bins - 1) * within / (n - bins)) / (between + within)


def test_given_data_indices_are_those_of_an_analysis_of_variance_and_near_openturns(small, folder):
    """Exactly those of scipy's F; within 0.2 (four deviations of 300 cases) of another estimator."""
    rows = lines("sensitivity", small.folder, "--metric", METRIC, "-o", folder / "g.csv")
    cases = small.table("cases").query("population == 'dispersed'")
    x = np.ascontiguousarray(cases[[small.columns[key] for key in KEYS]].to_numpy())
    y = cases[METRIC].to_numpy()
    other = ot.RankSobolSensitivityAlgorithm(ot.Sample(x), ot.Sample(y[:, None])).getFirstOrderIndices()
    for place, key in enumerate(KEYS):
        row = next(r for r in rows if r["key"] == key)
        found = float(row["first_order"])
        assert found == pytest.approx(between_bins(x[:, place], y), abs=1e-9)
        assert found == pytest.approx(other[place], abs=0.2)
        assert float(row["first_order_low"]) < found < float(row["first_order_high"])
        assert float(row["change_per_sigma"]) == pytest.approx(float(row["src"]) * y.std(ddof=1))
        assert row["intervals"] == "independent_cases" and row["metric"] == METRIC
    kept = list(csv.DictReader((small.folder / "analysis/sensitivity.csv").open()))
    assert kept == rows


@pytest.mark.parametrize("kind, replicates", [("latin_hypercube", 3), ("sobol", 4), ("sobol", 1)])
def test_indices_of_designs_have_students_intervals_over_replicates_or_none(runs, folder, kind, replicates):
    plan = f'kind = "{kind}"\nreplicates = {replicates}'
    run = runs(f"indices_{kind}_{replicates}", scenario("small", 96, plan))
    rows = lines("sensitivity", run.folder, "--metric", METRIC, "-o", folder / "d.csv")
    cases = run.table("cases").query("population == 'dispersed'")

    def indices(part):
        x = ot.Sample(np.ascontiguousarray(part[[run.columns[key] for key in KEYS]].to_numpy()))
        analysis = ot.CorrelationAnalysis(x, ot.Sample(part[[METRIC]].to_numpy()))
        return {"src": np.array(analysis.computeSRC()), "prcc": np.array(analysis.computePRCC())}

    whole = indices(cases)
    each = [indices(cases[cases.case % replicates == r]) for r in range(replicates)]
    for place, key in enumerate(KEYS):
        row = next(r for r in rows if r["key"] == key)
        for name in ["src", "prcc"]:
            assert float(row[name]) == pytest.approx(whole[name][place], abs=1e-8)
            if replicates == 1:
                assert row[name + "_low"] == "" and row["intervals"] == "none"
                continue
            values = [of[name][place] for of in each]
            low, high = scipy.stats.ttest_1samp(values, 0).confidence_interval(0.95)
            assert float(row[name + "_low"]) == pytest.approx(low, abs=1e-8)
            assert float(row[name + "_high"]) == pytest.approx(high, abs=1e-8)
            assert row["intervals"] == "replicates"


def test_influences_are_means_of_stored_derivatives_and_agree_with_regression(runs, folder):
    """Student's intervals of scipy; shares within 0.08 of squared coefficients of 300 cases (four deviations)."""
    run = runs("small_derivatives", scenario("small", 300, 'kind = "monte_carlo"') + "\n[sensitivity]\n")
    rows = lines("influence", run.folder, "--variant", "jet_damping", "-o", folder / "i.csv")
    modes = run.table("modes").query("population == 'dispersed' and variant == 'jet_damping' and branch == 'primary'")
    regression = lines("sensitivity", run.folder, "--metric", METRIC, "-o", folder / "i2.csv")
    variance = modes.damping_ratio.var(ddof=1)
    for key in KEYS:
        row = next(r for r in rows if r["key"] == key)
        by = modes["ddr_" + run.columns[key].removeprefix("draw_")].to_numpy()
        low, high = scipy.stats.ttest_1samp(by, 0).confidence_interval(0.95)
        found = [float(row[name]) for name in ("mean", "mean_low", "mean_high", "mean_modulus")]
        assert found == pytest.approx([by.mean(), low, high, np.abs(by).mean()], rel=1e-9, abs=1e-15)
        assert float(row["share_linear"]) == pytest.approx(by.mean() ** 2 / variance, rel=1e-9, abs=1e-15)
        src = float(next(r for r in regression if r["key"] == key)["src"])
        assert float(row["share_linear"]) == pytest.approx(src**2, abs=0.08)
        assert float(row["total_index_bound"]) >= float(row["share_linear"])
        # The bars of the tornado chart lie on the sides that the derivative says.
        swing = float(row["damping_ratio_at_high"]) - float(row["damping_ratio_at_low"])
        assert np.sign(swing) == np.sign(by.mean())


@pytest.mark.parametrize("plan, replicates", [
    ('kind = "latin_hypercube"\nreplicates = 4', 4),
    ('kind = "sobol"\nreplicates = 4', 4),
    ('kind = "sobol"', 1),
])
def test_influences_of_designs_have_students_intervals_over_replicates_or_say_how_to_get_them(
    runs, folder, plan, replicates
):
    name = f"influence_{plan.split(chr(34))[1]}_{replicates}"
    run = runs(name, scenario("small", 64, plan) + "\n[sensitivity]\n")
    text = tvse("influence", run.folder)
    rows = list(csv.DictReader((run.folder / "analysis/influence.csv").open()))
    if replicates == 1:
        assert "`replicates = 8`" in text and all(row["mean_low"] == "" for row in rows)
        return
    assert "no intervals" not in text
    modes = run.table("modes").query("population == 'dispersed' and branch == 'primary'").sort_values("case")
    for row in rows:
        by = modes[modes.variant == row["variant"]]["ddr_" + run.columns[row["key"]].removeprefix("draw_")].to_numpy()
        for values, what in [(by, "mean"), (abs(by), "mean_modulus")]:
            means = [values[turn::replicates].mean() for turn in range(replicates)]
            low, high = scipy.stats.ttest_1samp(means, 0).confidence_interval(0.95)
            found = (float(row[f"{what}_low"]), float(row[f"{what}_high"]))
            assert found == pytest.approx((low, high), rel=1e-9)


def test_crossed_indices_are_the_estimators_and_agree_with_openturns(runs, folder):
    run = runs("small_saltelli", scenario("small", None, 'kind = "saltelli"\nrows = 120'))
    rows = lines("sensitivity", run.folder, "--metric", METRIC, "-o", folder / "c.csv")
    cases = run.table("cases").query("population == 'dispersed'")
    y = cases[METRIC].to_numpy().reshape(120, len(KEYS) + 2)
    order = sorted(KEYS)
    first, second, variance = y[:, 0], y[:, 1], np.var(y[:, :2])
    design = cases[[run.columns[key] for key in order]].to_numpy().reshape(120, -1, len(order))
    stacked = np.concatenate([design[:, i] for i in range(len(order) + 2)])
    outputs = (y - y[:, :2].mean()).T.reshape(-1, 1)
    jansen = ot.JansenSensitivityAlgorithm(ot.Sample(stacked), ot.Sample(outputs), 120)
    for place, key in enumerate(order):
        row = next(r for r in rows if r["key"] == key)
        crossed = y[:, 2 + place]
        total = np.mean((first - crossed) ** 2) / 2 / variance
        index = np.mean((second - y[:, :2].mean()) * (crossed - first)) / variance
        assert float(row["total"]) == pytest.approx(total, rel=1e-9)
        assert float(row["first_order"]) == pytest.approx(index, rel=1e-6, abs=1e-9)
        # Its variance is that of the first sample alone.
        expected = jansen.getTotalOrderIndices()[place] * np.var(first, ddof=1) / variance
        assert float(row["total"]) == pytest.approx(expected, rel=0.02)


def test_outer_draws_hold_what_is_known_and_have_their_statements(runs, folder):
    plan = 'kind = "nested"\nouter = 6\ninner = 25\nallowed_share_unstable = 0.1\nrisk = 0.1'
    run = runs("small_nested", scenario("small", None, plan))
    cases = run.table("cases").query("population == 'dispersed'")
    assert (cases.outer == np.arange(150) // 25).all()
    for key in KEYS:
        distinct = cases.groupby("outer")[run.columns[key]].nunique()
        assert (distinct == (25 if key.startswith("modes") else 1)).all()
    summary = run.table("summary").query("population == 'dispersed'")
    of = summary[summary.flight_time_s.isna() & (summary.variant == "jet_damping")]
    whole, each = of[of.outer.isna()].iloc[0], of[of.outer.notna()]
    assert list(each.outer) == list(range(6)) and whole.intervals == "replicates"
    for row in each.itertuples():
        part = cases[cases.outer == row.outer][METRIC]
        bad = int((part < 0).sum())
        assert (row.unstable, row.cases) == (bad, 25)
        met = scipy.stats.binom.cdf(bad, 25, 0.1) <= 0.1
        not_met = scipy.stats.binom.sf(bad - 1, 25, 0.1) <= 0.1
        assert row.statement == ("met" if met else "not_met" if not_met else "undecided")
    met = int((each.statement == "met").sum())
    low, high = scipy.stats.binomtest(met, 6).proportion_ci(0.95, "exact")
    found = (whole.outer_share_met_low, whole.outer_share_met_high)
    assert whole.outer_met == met and found == pytest.approx((low, high), rel=1e-9, abs=1e-12)
    text = """
[[gate]]
id = "outer"
metric = "damping_ratio"
variant = "jet_damping"
statistic = "nested_statement"
threshold_1 = 0.0
at_least_percent = 30.0
confidence = 0.9
rationale = "test"
"""
    (folder / "nested.gates.toml").write_text(text)
    done = subprocess.run([TVSE, "gate", run.folder, "--gates", folder / "nested.gates.toml"], capture_output=True)
    gate = json.loads((run.folder / "gates.json").read_text())["gates"][0]
    assert (gate["cases"], gate["violations"], gate["value"]) == (6, 6 - met, pytest.approx(100 * met / 6))
    passes = scipy.stats.binom.cdf(6 - met, 6, 0.7) <= 0.1
    fails = scipy.stats.binom.sf(5 - met, 6, 0.7) <= 0.1
    assert gate["verdict"] == ("pass" if passes else "fail" if fails else "inconclusive")
    assert done.returncode == {"pass": 0, "fail": 1, "inconclusive": 4}[gate["verdict"]]
    means = cases.groupby("outer")[METRIC].mean()
    low, high = scipy.stats.ttest_1samp(means, 0).confidence_interval(0.95)
    assert (whole.damping_ratio_mean_low, whole.damping_ratio_mean_high) == pytest.approx((low, high), rel=1e-9)


def test_exact_claims_are_refused_where_cases_are_no_independent_draws(runs, folder):
    run = runs("small_sobol", scenario("small", 32, 'kind = "sobol"\nreplicates = 4'))
    gate = """
[[gate]]
id = "claim"
metric = "damping_ratio"
variant = "jet_damping"
statistic = "tolerance_bound"
coverage = 0.9
risk = 0.1
at_least_1 = 0.0
rationale = "refused"
"""
    (folder / "claim.gates.toml").write_text(gate)
    command = [TVSE, "gate", run.folder, "--gates", folder / "claim.gates.toml"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2 and "low-discrepancy sequence" in done.stderr
    command = [TVSE, "how-many", "--coverage", "0.9", "--risk", "0.1", "--run", run.folder]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2 and "no claim" in done.stderr and "low-discrepancy sequence" in done.stderr


def test_runs_are_compared_on_common_draws_alone(small, runs, folder):
    shorter = runs("small_shorter", scenario("small", 120, 'kind = "monte_carlo"'))
    rows = lines("compare", small.folder, shorter.folder, "--metric", METRIC, "-o", folder / "d.csv")
    assert float(rows[0]["value"]) == 0.0 and rows[0]["cases"] == "120"
    other = runs("small_other", scenario("small", 120, 'kind = "monte_carlo"').replace("seed = 7", "seed = 8"))
    command = [TVSE, "compare", small.folder, other.folder]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2 and "one seed" in done.stderr


@pytest.mark.parametrize("dispersion, plan", [
    ("correlated", 'kind = "latin_hypercube"\nreplicates = 2'),
    ("correlated", 'kind = "sobol"\nreplicates = 2'),
])
def test_threads_parts_and_extensions_give_the_same_bytes_or_are_refused(folder, dispersion, plan):
    path = folder / "parts.toml"
    path.write_text(scenario(dispersion, 24, plan))
    kind = plan.split('"')[1]
    whole, parts, short = (folder / f"{kind}-{name}" for name in ("whole", "parts", "short"))
    tables = lambda run: {p.name: p.read_bytes() for p in sorted((run / "tables").iterdir())}
    tvse("run", path, "-o", whole, "--jobs", 2)
    for part in (3, 1, 2):
        tvse("run", path, "-o", parts, "--jobs", 1, "--shard", f"{part}/3")
    tvse("merge", parts)
    assert tables(parts) == tables(whole)
    tvse("run", path, "-o", short, "--cases", 16)
    done = subprocess.run([TVSE, "run", path, "-o", short, "--extend", "8"], capture_output=True, text=True)
    if kind == "sobol":
        assert done.returncode == 0, done.stderr
        assert tables(short) == tables(whole)
        done = subprocess.run([TVSE, "run", path, "-o", short, "--extend", "3"], capture_output=True, text=True)
        assert done.returncode == 2 and "multiple of 2" in done.stderr
    else:
        assert done.returncode == 2
        assert "keeps its first cases" in done.stderr or "populations" in done.stderr
