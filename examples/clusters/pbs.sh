#!/bin/bash
# A campaign as a PBS job array (PBS Pro, OpenPBS). Edit the three variables, then:
#   array=$(qsub -J 1-8 -v SHARDS=8 examples/clusters/pbs.sh)
#   qsub -W depend=afterok:$array -v MERGE=1 examples/clusters/pbs.sh
# Tasks whose cases are missing: tvse status OUTPUT --missing 8, then qsub -J with their numbers
# (a single one: qsub -v SHARDS=8,PBS_ARRAY_INDEX=3 examples/clusters/pbs.sh).
#PBS -N tvse
#PBS -l select=1:ncpus=4
#PBS -l walltime=01:00:00
#PBS -j oe
set -euo pipefail
TVSE=${TVSE:-$HOME/tvse/target/release/tvse}
RUN=${RUN:-$HOME/tvse/runs/reference.toml}
OUTPUT=${OUTPUT:-$HOME/results/reference}

if [ -n "${MERGE:-}" ]; then
    exec "$TVSE" merge "$OUTPUT"
fi
exec "$TVSE" run "$RUN" --output "$OUTPUT" --jobs "${NCPUS:-4}" \
    --shard-from-env --shards "$SHARDS" --progress json
