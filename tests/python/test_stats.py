"""`tvse how-many` against scipy's binomial law."""

import re

import pytest
import scipy.stats

from conftest import tvse

CLAIMS = [(0.9, 0.1), (0.95, 0.05), (0.99, 0.05), (0.9973, 0.10), (0.99865, 0.05), (0.5, 0.01)]


def rows(*options):
    """Rows of the printed table as numbers."""
    text = tvse("how-many", *options)
    cells = re.findall(r"^\|\s*(\d+)\s*\|\s*([\d.e-]+)\s*\|\s*([\w.]*)", text, re.M)
    assert cells
    return cells


def risk(n, exceedances, coverage):
    """Probability that a bound with so many exceedances among n keeps less than the coverage."""
    return scipy.stats.binom.cdf(exceedances, n, 1 - coverage)


@pytest.mark.parametrize("coverage, allowed", CLAIMS)
@pytest.mark.parametrize("two_sided", [False, True])
def test_the_least_number_of_cases_is_the_least(coverage, allowed, two_sided):
    options = ["--coverage", coverage, "--risk", allowed] + ["--two-sided"] * two_sided
    for k, cases, actual in rows(*options):
        beyond = 2 * int(k) + 1 if two_sided else int(k)
        assert risk(int(cases), beyond, coverage) <= allowed < risk(int(cases) - 1, beyond, coverage)
        assert abs(float(actual) / 100 / risk(int(cases), beyond, coverage) - 1) < 6e-4


@pytest.mark.parametrize("coverage, allowed", CLAIMS)
def test_a_campaign_may_have_the_exceedances_stated(coverage, allowed):
    for k, actual, holds in rows("--coverage", coverage, "--risk", allowed, "--cases", 2000):
        expected = risk(2000, int(k), coverage)
        assert (holds == "yes") == (expected <= allowed)
        assert float(actual) / 100 == pytest.approx(expected, rel=6e-4, abs=1e-300)


def test_the_largest_number_of_exceedances_is_that_of_the_reference():
    for coverage, most in [(0.95, 87), (0.99, 13), (0.9973, 2), (0.99865, 0)]:
        text = tvse("how-many", "--coverage", coverage, "--risk", 0.1, "--cases", 2000)
        assert f"at most {most} exceedance" in text
        assert risk(2000, most, coverage) <= 0.1 < risk(2000, most + 1, coverage)
