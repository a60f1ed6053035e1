"""The notebooks are executed, the module python/tvse is held against the program, and every column that the
scripts for MATLAB and Julia name is in the tables."""

import re
import shutil
import sys

import nbformat
import numpy as np
import pandas as pd
import pytest
from nbclient import NotebookClient

from conftest import ROOT, TVSE, tvse

sys.path.insert(0, str(ROOT / "python"))
import tvse as module  # noqa: E402

NOTEBOOKS = ["pandas", "polars", "duckdb"]


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A copy of what the notebooks need, so that runs are made anew."""
    folder = tmp_path_factory.mktemp("study")
    for name in ["vehicles", "dispersions", "notebooks", "python"]:
        shutil.copytree(ROOT / name, folder / name)
    (folder / "runs").mkdir()
    for name in ["notebook.toml", "notebook-six.toml"]:
        shutil.copy(ROOT / "runs" / name, folder / "runs")
    return folder


@pytest.fixture(scope="module")
def runs(study):
    return [module.run(study / f"runs/{name}.toml", program=TVSE) for name in ["notebook", "notebook-six"]]


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_from_its_first_cell_to_its_last(study, runs, name, monkeypatch):
    monkeypatch.setenv("TVSE", str(TVSE))
    notebook = nbformat.read(study / f"notebooks/{name}.ipynb", as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "committed without outputs"
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(study / "notebooks")}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 3
    texts = "".join(output.get("text", "") for output in outputs)
    assert "95 % interval" in texts


def test_the_three_notebooks_find_the_same_numbers(runs):
    first, second = runs
    paired = module.pair(second, first, "damping_ratio_min_jet_damping_tvse")
    text = tvse("compare", second.folder, first.folder, "--metric", "damping_ratio_min_jet_damping_tvse")
    mean = next(line for line in text.splitlines() if "| mean" in line).split("|")[4]
    assert float(mean) == pytest.approx(paired["difference"].mean(), rel=1e-3)


def test_units_come_from_the_schema_and_agree_with_the_dictionary(runs):
    units = runs[0].units("modes")
    assert units["pole_re_rad_s"] == "rad/s" and units["frequency_hz"] == "Hz"
    columns = runs[0].table("columns", engine="polars")
    for table, column, unit in columns.select("table", "column", "unit").iter_rows():
        assert runs[0].units(table).get(column) == unit, (table, column)
    assert "damping" in runs[0].describe("modes")["damping_ratio"].lower()


def test_runs_that_do_not_share_their_draws_are_refused(study, runs):
    text = (study / "runs/notebook.toml").read_text().replace("seed = 20130819", "seed = 7")
    (study / "runs/other.toml").write_text(text.replace("cases = 400", "cases = 5"))
    other = module.run(study / "runs/other.toml", program=TVSE)
    with pytest.raises(ValueError, match="do not share their draws"):
        module.pair(runs[0], other, "damping_ratio_min_jet_damping_tvse")


def test_a_tolerance_bound_is_the_order_statistic_of_the_tables():
    # Least numbers of cases for 0 to 3 exceedances, 95 % and 99.73 %, 10 % risk.
    for coverage, least in [(0.95, [45, 77, 105, 132]), (0.9973, [852, 1440, 1970, 2473])]:
        for exceedances, cases in enumerate(least):
            assert module.tolerance_bound(range(cases), coverage, 0.10) == exceedances
            fewer = module.tolerance_bound(range(cases - 1), coverage, 0.10)
            assert fewer == (exceedances - 1 if exceedances else None)
    # A failed case stands below all others.
    assert module.tolerance_bound([np.nan, *range(92)], 0.95, 0.05) == 0.0
    assert module.tolerance_bound([np.nan, np.nan, *range(91)], 0.95, 0.05) is None


def test_the_scripts_for_matlab_and_julia_name_columns_that_exist(runs):
    known = set().union(*(pd.read_parquet(runs[0].path(table)).columns for table in ["modes", "cases"]))
    matlab = (ROOT / "notebooks/poles.m").read_text()
    named = set(re.findall(r"(?:modes|cases|drawn)\.([a-z_]+)", matlab)) - {"parquet"}
    named |= {n for block in re.findall(r"SelectedVariableNames = \.\.\.\n\s*\[(.*?)\]", matlab) for n in re.findall(r'"(\w+)"', block)}
    julia = (ROOT / "notebooks/poles.jl").read_text()
    named |= set(re.findall(r"(?:drawn|modes|cases)\.([a-z_]+)", julia)) - {"parquet"}
    named |= set(re.findall(r"[\[ (]:([a-z_]+)", julia)) - {"unstable_percent"}
    assert len(named) > 8 and named <= known, named - known
