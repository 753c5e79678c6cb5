#!/bin/sh
# A study on a SLURM cluster: one scheduler, a worker for each task, and the run. Submit it, on a shared file system:
#
#     sbatch --ntasks=32 examples/slurm.sh STUDY.toml OUT
#
# When its time is up, submit it again: the run goes on where it was.
#SBATCH --job-name=vibrissa
#SBATCH --ntasks=8
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=3G
#SBATCH --time=04:00:00
#SBATCH --signal=B:TERM@60

set -eu
study=$1 out=$2
# . /path/to/vibrissa/.venv/bin/activate

export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1
export MPLBACKEND=agg
file=$PWD/scheduler-${SLURM_JOB_ID:-$$}.json
run='' workers='' scheduler=''
trap 'kill $run $workers $scheduler 2>/dev/null || true; rm -f "$file"' EXIT
trap 'kill -TERM $run 2>/dev/null || true' TERM

dask scheduler --scheduler-file "$file" --port 0 --no-dashboard >"$file.log" 2>&1 &
scheduler=$!
until [ -s "$file" ]; do
    kill -0 "$scheduler" # it has ended: its log says why
    sleep 1
done
${SLURM_JOB_ID:+srun} dask worker --scheduler-file "$file" --nthreads 1 --no-dashboard \
    --memory-limit 2GiB --local-directory "${TMPDIR:-/tmp}" >"$file.workers.log" 2>&1 &
workers=$!

vibrissa run "$study" --out "$out" --scheduler "$file" &
run=$!
code=0
wait "$run" || code=$?
while kill -0 "$run" 2>/dev/null; do # the time is up: it was told, and ends cleanly
    code=0
    wait "$run" || code=$?
done
exit "$code"
