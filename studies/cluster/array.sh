#!/usr/bin/env bash
# A sweep as a Slurm job array: every task answers its part into the folder that all share, a last job writes the tables.
#
#   studies/cluster/array.sh SCENE OUT PARTS --over contact.tilt.angle="1e-6 rad..1e-3 rad:40" ...
#
# Run it again with the same words after a failure: what is there is kept. Options of the site, such as an account or a
# partition, go into SBATCH_ACCOUNT, SBATCH_PARTITION and so on, which sbatch reads by itself.
set -euo pipefail
scene=$1 out=$2 parts=$3
shift 3
sweep="patchfem sweep $(printf '%q ' "$scene" -o "$out" "$@")"
array=$(sbatch --parsable --job-name=patchfem --array="1-$parts" --cpus-per-task=1 --mem=2G --time=04:00:00 \
    --wrap "$sweep --shard \$SLURM_ARRAY_TASK_ID/$parts")
# afterany: where a part failed, --collect says how many cases have no answer
sbatch --parsable --job-name=patchfem-tables --dependency="afterany:${array%%;*}" --cpus-per-task=1 --mem=2G \
    --time=00:30:00 --wrap "$sweep --collect"
