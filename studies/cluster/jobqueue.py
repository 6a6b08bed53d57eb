"""How does a sweep run on the nodes of a Slurm cluster, started and stopped by Dask?

As on this machine: dask-jobqueue submits a job per worker, the workers report to a scheduler in this process, and the
sweep takes its address. The answers are those of `patchfem sweep`; what was done before a job ended is kept. Wants
`pip install "patchfem[cluster]" dask-jobqueue`, and a folder that the nodes share.

Run: python studies/cluster/jobqueue.py SCENE OUT JOBS "contact.tilt.angle=1e-6 rad..1e-3 rad:40" ...
"""

import sys

from dask_jobqueue import SLURMCluster

import patchfem as pf

# resources of a job, which runs one worker
JOB = {"cores": 1, "processes": 1, "memory": "2GB", "walltime": "04:00:00"}


def main(scene: str, out: str, jobs: str, *over: str, **more):
    """Run a sweep over texts "key=values" on several jobs and return its Dataset.

    `more` are options of the SLURMCluster, such as account.
    """
    with SLURMCluster(**JOB | more) as cluster:
        cluster.scale(jobs=int(jobs))
        with cluster.get_client() as client:
            # the sweep makes as many chunks as there are workers at its start
            client.wait_for_workers(int(jobs))
            keys = dict(one.split("=", 1) for one in over)
            return pf.sweep(
                scene, keys, out=out, executor=f"dask:{cluster.scheduler_address}", resume=True
            )


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
