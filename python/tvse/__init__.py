"""Runs of `tvse` in Python: tables, units, and pairs of runs on the same draws.

Only what every notebook needs; the tables are flat Parquet, so that any reader does as well. Nothing here
is compiled; `pandas` or `polars` is imported when a table is asked for.
"""

import json
import math
import os
import shutil
import subprocess
from pathlib import Path

__all__ = ["Run", "pair", "run", "tolerance_bound"]


class Run:
    """A finished run in its folder."""

    def __init__(self, folder):
        self.folder = Path(folder)
        manifest = self.folder / "manifest.json"
        if not manifest.is_file():
            raise FileNotFoundError(f"{manifest}: no manifest, so this is no finished run")
        self.manifest = json.loads(manifest.read_text(encoding="utf-8"))
        self.definition = self.manifest["run"]["definition"]
        self.draws = {draw["key"]: draw["column"] for draw in self.manifest["run"]["draws"]}
        """Column of every draw key."""

    def path(self, table):
        """File of a table, for DuckDB and other readers of files."""
        if table not in self.manifest["tables"]:
            raise KeyError(f"no table {table!r}; there are {', '.join(sorted(self.manifest['tables']))}")
        return str(self.folder / "tables" / f"{table}.parquet")

    def table(self, name, columns=None, engine="pandas"):
        """A table as a data frame of `pandas` or `polars`."""
        if engine == "pandas":
            import pandas

            return pandas.read_parquet(self.path(name), columns=columns)
        if engine == "polars":
            import polars

            return polars.read_parquet(self.path(name), columns=columns)
        raise ValueError(f"engine {engine!r}; there are 'pandas' and 'polars'")

    def units(self, table):
        """Unit of every column that holds a number, from the metadata of the table's schema."""
        import pyarrow.parquet

        schema = pyarrow.parquet.read_schema(self.path(table))
        units = {field.name: (field.metadata or {}).get(b"unit") for field in schema}
        return {name: unit.decode() for name, unit in units.items() if unit}

    def describe(self, table):
        """What every column means, from the metadata of the table's schema."""
        import pyarrow.parquet

        schema = pyarrow.parquet.read_schema(self.path(table))
        return {field.name: (field.metadata or {}).get(b"description", b"").decode() for field in schema}

    def __repr__(self):
        cases = ", ".join(f"{p['name']} {p['cases']}" for p in self.definition["populations"])
        return f"Run({str(self.folder)!r}: {cases}; seed {self.definition['seed']})"


def run(file, folder=None, program=None):
    """The run of the run file `file`, carried out unless its folder is there already."""
    file = Path(file)
    folder = Path(folder) if folder is not None else file.with_suffix("")
    if not (folder / "manifest.json").is_file():
        program = program or os.environ.get("TVSE") or shutil.which("tvse")
        if program is None:
            raise FileNotFoundError("the program tvse is not on the path; set $TVSE to it")
        command = [str(program), "run", str(file), "--output", str(folder), "--resume"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
    return Run(folder)


def pair(first, second, metric, population="dispersed"):
    """A metric of two runs case by case: a pandas frame with `case`, `first`, `second`, `difference`.

    Refuses runs whose draws differ in any key that both have. Cases that failed in either have no
    difference (NaN).
    """
    common = [column for key, column in first.draws.items() if second.draws.get(key) == column]
    frames = []
    for of in (first, second):
        frame = of.table("cases", columns=["population", "case", metric, *common])
        frames.append(frame[frame["population"] == population].set_index("case").drop(columns="population"))
    a, b = frames
    cases = a.index.intersection(b.index)
    a, b = a.loc[cases], b.loc[cases]
    for column in common:
        differs = ~((a[column] == b[column]) | (a[column].isna() & b[column].isna()))
        if differs.any():
            raise ValueError(f"{column} differs in case {cases[differs][0]}: the runs do not share their draws")
    paired = a[[metric]].rename(columns={metric: "first"})
    paired["second"] = b[metric]
    paired["difference"] = paired["first"] - paired["second"]
    return paired.reset_index()


def tolerance_bound(values, coverage=0.9973, risk=0.10):
    """The value that `coverage` of the population lies above, with at most `risk` of being wrong.

    An order statistic of independent draws (Wilks): the (k + 1)-th least value, k the most exceedances with
    P(X <= k | n, 1 - coverage) <= risk. A failed case (None, NaN) counts as the worst. None where the cases
    are too few.
    """
    bad = [-math.inf if v is None or math.isnan(v) else float(v) for v in values]
    n, p = len(bad), 1.0 - coverage
    allowed, probability = -1, 0.0
    log_choose = 0.0
    for k in range(n):
        probability += math.exp(log_choose + k * math.log(p) + (n - k) * math.log1p(-p))
        if not probability <= risk:
            break
        allowed = k
        log_choose += math.log(n - k) - math.log(k + 1)
    if allowed < 0:
        return None
    bound = sorted(bad)[allowed]
    return None if math.isinf(bound) else bound
