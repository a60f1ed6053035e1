"""Draws against the mapping that README states, written out again, and the laws of scipy."""

import json
import tomllib

import numpy as np
import pandas as pd
import pyarrow.parquet as parquet
import pytest
import scipy.stats
from blake3 import blake3
from scipy.special import ndtr, ndtri

import oracle
from conftest import ROOT, run_file, tvse

MASK = 0xFFFFFFFF


def chacha8(key, counter):
    """One block of ChaCha with 8 rounds, 64-bit counter and nonce zero: sixteen 32-bit words."""
    words = [int.from_bytes(key[i : i + 4], "little") for i in range(0, 32, 4)]
    start = [0x61707865, 0x3320646E, 0x79622D32, 0x6B206574, *words]
    start += [counter & MASK, counter >> 32, 0, 0]
    s = list(start)

    def quarter(a, b, c, d):
        for p, q, r, turn in [(a, b, d, 16), (c, d, b, 12), (a, b, d, 8), (c, d, b, 7)]:
            s[p] = (s[p] + s[q]) & MASK
            s[r] ^= s[p]
            s[r] = (s[r] << turn | s[r] >> (32 - turn)) & MASK

    for _ in range(4):
        for i in range(4):
            quarter(i, 4 + i, 8 + i, 12 + i)
        for i in range(4):
            quarter(i, 4 + (i + 1) % 4, 8 + (i + 2) % 4, 12 + (i + 3) % 4)
    return [(a + b) & MASK for a, b in zip(s, start)]


def uniform(seed, key, case):
    """u = (2j + 1)/2^53 of a draw key in a case."""
    text = key.encode()
    message = seed.to_bytes(8, "little") + len(text).to_bytes(8, "little") + text
    stream = blake3(message, derive_key_context="tvse draw v1").digest()
    words = chacha8(stream, 2 * case // 16)
    at = 2 * case % 16
    return (2 * ((words[at] | words[at + 1] << 32) >> 12) + 1) * 2.0**-53


def law(text):
    """Distribution of a law of a dispersion table: cdf and inverse."""
    t = dict(text)
    kind = t.pop("kind")
    sigma = t.get("sigma", t.get("three_sigma", 0) / 3)
    if kind == "fixed":
        return None, lambda u: t["value"]
    if kind == "normal":
        law = scipy.stats.norm(t["mean"], sigma)
    elif kind == "truncated_normal":
        score = lambda side, infinite: (
            (t[side] - t["mean"]) / sigma if side in t else t.get(f"{side}_sigma", infinite)
        )
        low, high = score("low", -np.inf), score("high", np.inf)
        below, width = ndtr(low), ndtr(high) - ndtr(low)
        law = scipy.stats.truncnorm(low, high, t["mean"], sigma)
        return law.cdf, lambda u: t["mean"] + sigma * ndtri(below + u * width)
    elif kind == "uniform":
        law = scipy.stats.uniform(t["low"], t["high"] - t["low"])
    elif kind == "triangular":
        width = t["high"] - t["low"]
        law = scipy.stats.triang((t["mode"] - t["low"]) / width, t["low"], width)
    elif kind == "lognormal":
        law = scipy.stats.lognorm(t["sigma_ln"], scale=t["median"])
    elif kind == "beta":
        law = scipy.stats.beta(t["alpha"], t["beta"], t["low"], t["high"] - t["low"])
    elif kind == "discrete":
        order = np.argsort(t["values"])
        values, weights = np.array(t["values"])[order], np.array(t["weights"])[order]
        return None, lambda u: values[np.searchsorted(np.cumsum(weights) / sum(weights), u)]
    elif kind == "empirical":
        values = t["values"] if "probabilities" in t else sorted(t["values"])
        at = t.get("probabilities", np.linspace(0, 1, len(values)))
        return None, lambda u: np.interp(u, at, values)
    return law.cdf, law.ppf


class Plan:
    """The draws of `tvse plan`: values by key."""

    def __init__(self, run_file, target, draws, table):
        tvse("plan", run_file, "-o", target)
        text = pd.read_parquet(target)
        self.values = text[text.population == "dispersed"].set_index("case")
        outline = json.loads(parquet.read_metadata(target).metadata[b"tvse.run"])
        self.seed = outline["definition"]["seed"]
        self.columns = {d["key"]: d["column"] for d in outline["draws"]}
        self.draws, self.table = draws, table

    def expected(self, key, case):
        u = uniform(self.seed, key, case)
        if key.startswith("common."):
            return ndtri(u)
        row = self.draws[key].row
        if "common" in row:
            shared = ndtri(uniform(self.seed, f"common.{row['common']} @ vehicle", case))
            weight = row["common_weight"]
            u = ndtr(weight * shared + np.sqrt(1 - weight**2) * ndtri(u))
        return law(row["law"])[1](u)


def make_plan(runs, name, vehicle, dispersion, cases, seed):
    path = runs.folder / f"{name}.toml"
    text = run_file(vehicle, dispersion, cases, [95.0], ["*.*"], ["no_jet_damping"])
    path.write_text(text.replace("seed = 7", f"seed = {seed}"))
    table = tomllib.loads((runs.folder / dispersion).read_text())
    draws = oracle.draws(oracle.Vehicle(runs.folder / vehicle), table)
    return Plan(path, runs.folder / f"{name}.parquet", draws, table)


SKEWED = ("vehicles/skewed", "dispersions/skewed.toml")


@pytest.fixture(scope="module", params=[0, 7, 2**63 - 1])
def plan(request, runs, skewed):
    return make_plan(runs, f"plan_{request.param}", *SKEWED, 40, request.param)


def test_the_keys_are_those_of_the_rows(plan):
    commons = [f"common.{c['id']} @ vehicle" for c in plan.table.get("common", [])]
    assert set(plan.columns) == set(plan.draws) | set(commons)
    # What README gives as examples of each level.
    assert {"*.*.nozzle.mass @ vehicle", "booster.left.nozzle.mass @ engine"} <= set(plan.columns)
    assert "booster.left.gimbal.*.shape @ engine # whole_gimbal" in plan.columns
    assert "core.3.actuator.tilt.damping @ actuator" in plan.columns


def test_values_are_those_of_the_published_mapping(plan):
    for key, column in plan.columns.items():
        for case in [0, 1, 7, 8, 39]:
            found, expected = plan.values[column][case], plan.expected(key, case)
            # Relative to the larger of value and spread: an offset near zero is a difference.
            spread = 1 if key.startswith("common.") else abs(law(plan.draws[key].row["law"])[1](0.9))
            assert abs(found - expected) <= 1e-12 * max(abs(expected), spread), (key, case)


def test_labels_with_a_common_ancestor_draw_one_value(plan):
    package = oracle.Package(ROOT / "vehicles/sls-like/modes")
    children = package.parents[package.parents.overlap > 0.5]
    assert len(children) > 0
    for child in children.itertuples():
        assert f"core.1.gimbal.{child.label}.shape @ mode" not in plan.columns
        of_parent = plan.draws[f"core.1.gimbal.{package.ancestor(child.label)}.shape @ mode"]
        assert f"core.1.gimbal.{child.label}.shape" in of_parent.targets


def test_draws_follow_their_laws(runs, skewed):
    """Kolmogorov–Smirnov on 2000 cases of each continuous key: false alarm once in 10⁶ a test suite."""
    plan = make_plan(runs, "plan_ks", *SKEWED, 2000, 99)
    tested = 0
    keys = [key for key in plan.draws if not key.count(".gimbal.") or ".m006." in key]
    for key in keys:
        cdf = law(plan.draws[key].row["law"])[0]
        if cdf is not None:
            p = scipy.stats.kstest(plan.values[plan.columns[key]], cdf).pvalue
            assert p > 1e-6 / len(keys), (key, p)
            tested += 1
    assert tested > 40


def test_discrete_draws_have_their_weights(runs, skewed):
    """χ² on 2000 cases: false alarm once in 10⁶."""
    plan = make_plan(runs, "plan_chi", *SKEWED, 2000, 5)
    values = plan.values[plan.columns["booster.right.mass_flow @ engine"]]
    counts = [(values == v).sum() for v in [-200.0, 0.0, 150.0]]
    assert sum(counts) == 2000
    assert scipy.stats.chisquare(counts, [1000, 500, 500]).pvalue > 1e-6


def test_correlated_scores_have_their_weight(runs, skewed):
    """Correlation of 0.8² between two modes that share a score: five standard deviations."""
    plan = make_plan(runs, "plan_rho", *SKEWED, 2000, 31)
    scores = plan.values.filter(regex=r"^z_modes_m\d+_frequency_scale").T
    assert len(scores) >= 2
    rho = np.corrcoef(scores.iloc[0], scores.iloc[1])[0, 1]
    assert abs(np.arctanh(rho) - np.arctanh(0.64)) * np.sqrt(2000 - 3) < 5


def test_the_mapping_is_that_of_version_1():
    """A vector that the program pins too."""
    assert uniform(0, "booster.left.nozzle.mass @ engine", 0) == 0.8114660119131892
