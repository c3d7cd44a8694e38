# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Localizes 100 drawn logs in 10 drawn maps by the workflow of share/d2s1r/fleet on a Slurm that this machine runs for
it, as root, without systemd: munged, slurmctld and slurmd (Debian's munge and slurm-wlm) in a folder of their own, and
ended at the end. Meanwhile all processes of one job are killed, and slurmd is killed and started again; one log is
damaged, one map is missing. The merged frames must be those of the program run on log after log, but for times, and a
second run must start no job.
Usage: RAWLOG_LOCALIZE=build/release/apps/rawlog-localize/rawlog-localize fleet_on_slurm.py"""
import csv
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "tests/python"))
from drawn_world import World  # noqa: E402
from test_fleet import (FLEET, OPTIONS, rows_one_after_another, split_drive, without_times,  # noqa: E402
                        write_damaged_log, write_manifest)

SLURM_CONF = """ClusterName=one
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmUser=root
ReturnToService=2
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory=16000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
# The first try of one log hangs until it is killed.
PROGRAM = """#!/bin/sh
case "$*" in *map3_part5.log*) [ -e hanging ] || { echo "$SLURM_JOB_ID" >hanging; exec sleep 600; } ;; esac
exec "$RAWLOG_LOCALIZE" "$@"
"""


class Slurm:
    """The daemons, from entering to leaving a with statement."""

    def __init__(self, folder):
        self.folder = folder
        for name in "state", "spool":
            (folder / name).mkdir(parents=True)
        folder.chmod(0o755)
        conf = folder / "slurm.conf"
        conf.write_text(SLURM_CONF.format(host=socket.gethostname().split(".")[0], folder=folder, cores=os.cpu_count()))
        os.environ["SLURM_CONF"] = str(conf)
        (folder / "munge.key").write_bytes(os.urandom(1024))
        (folder / "munge.key").chmod(0o400)

    def __enter__(self):
        munge = [f"--{option}={self.folder}/munge.{suffix}" for option, suffix in
                 (("key-file", "key"), ("socket", "socket"), ("pid-file", "pid"), ("log-file", "log"),
                  ("seed-file", "seed"))]
        subprocess.run(["munged", "--force", *munge], check=True)
        subprocess.run(["slurmctld"], check=True)
        time.sleep(2)
        self.start_slurmd()
        wait_for(lambda: "idle" in output_of("sinfo", "--noheader", "--format=%T"), "a node that is idle")
        return self

    def start_slurmd(self):
        subprocess.run(["slurmd"], check=True)

    def kill(self, daemon, how):
        file = self.folder / f"{daemon}.pid"
        if file.exists():
            os.kill(int(file.read_text()), how)

    def __exit__(self, *_):
        subprocess.run(["scancel", "--user=root"], check=False)  # what an error above has left
        for daemon in "slurmd", "slurmctld", "munge":
            self.kill(daemon, signal.SIGTERM)
            time.sleep(1)


def output_of(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout


def wait_for(condition, what, seconds=300):
    for _ in range(seconds):
        if condition():
            return
        time.sleep(1)
    sys.exit(f"waited {seconds} s in vain for {what}")


def write_fleet(folder):
    rows = []
    for i in range(10):
        site = folder / f"site{i}"
        site.mkdir()
        World(site, boxes=[(1 + 0.5 * i, 6.8, 1.4 + 0.5 * i, 7.2)])
        rows += [[f"site{i}/{log}", f"site{i}/map.yaml", OPTIONS] for log in split_drive(site, f"map{i}_part")]
    write_damaged_log(folder / rows[42][0])
    (folder / "site7/map.yaml").unlink()
    write_manifest(folder, rows)
    (folder / "program").write_text(PROGRAM)
    (folder / "program").chmod(0o755)
    return rows


def start_fleet(folder):
    log = open(folder / "snakemake.log", "w")
    return subprocess.Popen(
        ["snakemake", "-s", FLEET / "Snakefile", "--profile", FLEET / "slurm", "--config", "manifest=logs.csv", "memory=500",
         f"program={folder / 'program'}"], cwd=folder, stdout=log, stderr=log)


def jobs_started(folder):
    lines = (folder / "snakemake.log").read_text().splitlines()
    return sum(line.startswith("Submitted job") for line in lines)


def main():
    with tempfile.TemporaryDirectory(dir="/var/tmp") as name:
        folder = pathlib.Path(name)
        rows = write_fleet(folder)
        print("drawn: 100 logs, 10 maps; one log damaged, one map missing", flush=True)
        with Slurm(folder / "slurm") as slurm:
            start = time.time()
            fleet = start_fleet(folder)
            wait_for((folder / "hanging").exists, "the job that is to be killed")
            job = (folder / "hanging").read_text().strip()
            processes = [int(line.split()[0]) for line in output_of("scontrol", "listpids", job).splitlines()[1:]]
            for process in processes:
                os.kill(process, signal.SIGKILL)
            print(f"killed the {len(processes)} processes of job {job}", flush=True)
            wait_for(lambda: len(list((folder / "fleet/logs").glob("*.json"))) > 40, "40 logs")
            slurm.kill("slurmd", signal.SIGKILL)
            time.sleep(5)
            slurm.start_slurmd()
            print("killed slurmd, and started it again after 5 s", flush=True)
            assert fleet.wait() == 0, (folder / "snakemake.log").read_text()
            print(f"done: {jobs_started(folder)} jobs of Slurm in {time.time() - start:.0f} s", flush=True)
            assert start_fleet(folder).wait() == 0
            print(f"a second run: {jobs_started(folder)} jobs", flush=True)
            assert jobs_started(folder) == 0
        with open(folder / "fleet/frames.csv", newline="") as stream:
            frames = without_times(csv.reader(stream))
        assert frames == rows_one_after_another(folder, rows)
        print(f"{len(frames) - 1} frames, the same as by the program alone, but for times")
        print((folder / "fleet/failed.csv").read_text())


if __name__ == "__main__":
    for needed in "munged", "slurmctld", "slurmd", "snakemake":
        if not shutil.which(needed):
            sys.exit(f"{needed} is missing")
    main()
