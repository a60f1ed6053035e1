"""Drives the shards of a campaign from Dask, then merges them.

    python dask_shards.py tvse runs/reference.toml results/reference 8 [tcp://scheduler:8786]

Without an address the shards run one after the other or in threads of this process; with one they
run on the workers of that cluster, which must see the same files. Tasks that are lost are run again
by Dask, and go on where their shard was."""

import subprocess
import sys

import dask


@dask.delayed
def shard(program: str, run: str, output: str, number: int, count: int) -> str:
    """Evaluates one shard; repeated, it evaluates only what is missing."""
    command = [program, "run", run, "--output", output, "--jobs", "1", "--shard", f"{number}/{count}"]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main(program: str, run: str, output: str, count: int, address: str | None) -> None:
    shards = [shard(program, run, output, number, count) for number in range(1, count + 1)]
    if address:
        from dask.distributed import Client

        with Client(address):
            said = dask.compute(*shards)
    else:
        said = dask.compute(*shards, scheduler="threads", num_workers=2)
    print("".join(said), end="")
    subprocess.run([program, "merge", output], check=True)


if __name__ == "__main__":
    program, run, output, count, *address = sys.argv[1:]
    main(program, run, output, int(count), address[0] if address else None)
