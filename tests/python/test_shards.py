"""Campaigns in parts: the Dask example gives the bytes of one local run, the templates are scripts."""

import os
import subprocess
import sys

import pyarrow.parquet as pq

from conftest import ROOT, TVSE, tvse

TABLES = ["cases", "modes", "summary", "worst", "columns"]
CLUSTERS = ROOT / "examples/clusters"


def test_shards_driven_by_dask_give_the_bytes_of_a_local_run(smoke, tmp_path):
    output = tmp_path / "run"
    command = [sys.executable, CLUSTERS / "dask_shards.py", TVSE, "runs/smoke.toml", output, "3"]
    done = subprocess.run(list(map(str, command)), cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "shard 3/3" in done.stdout and "tvse, dispersed" in done.stdout
    for table in TABLES:
        name = f"tables/{table}.parquet"
        assert (output / name).read_bytes() == (smoke.folder / name).read_bytes(), table
        assert pq.read_table(output / name).num_rows > 0


def test_the_pbs_template_runs_its_shards_and_merges_them(smoke, tmp_path):
    output = tmp_path / "run"
    run = {"TVSE": str(TVSE), "RUN": str(ROOT / "runs/smoke.toml"), "OUTPUT": str(output)}
    for task in [{"PBS_ARRAY_INDEX": "2"}, {"PBS_ARRAY_INDEX": "1"}, {"MERGE": "1"}]:
        environment = {**os.environ, **run, "SHARDS": "2", "NCPUS": "2", **task}
        subprocess.run(["bash", CLUSTERS / "pbs.sh"], env=environment, check=True, capture_output=True)
    name = "tables/modes.parquet"
    assert (output / name).read_bytes() == (smoke.folder / name).read_bytes()
    assert "finished: 51 of 51 cases" in tvse("status", output)
