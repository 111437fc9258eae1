#!/usr/bin/env python3
"""Campaigns over many ranks come to what one rank comes to, and a rank that is lost is named (ci/cluster/).

Usage: cluster_test.py slurm|mpirun CUTPROOF SOURCES
slurm runs ci/cluster/fuzz.slurm and fuzz_shard.sh in the environments that Slurm, srun and mpiexec make; mpirun runs
ci/cluster/fuzz_mpi.sh. Exit status: 0 all is as it should be, 1 something is not, 77 there is no mpirun.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

CAMPAIGN = ["--backend", "reference", "--dynamics", "--cases", "90", "--sizes", "0-40", "--seed", "5"]
TIMES = ("seconds", "cases_per_second", "thread_seconds")
# Of the machine, and of how the work was divided.
DIVISION = ("threads", "merged_shards", "complete", "missing_shards")
# What this test's own surroundings may have set must not reach a rank.
OURS = re.compile(r"(SLURM|OMPI|PMI|MPI|CUTPROOF|PMIX|PRTE)_")
wrong = []


def expect(holds, what):
    if not holds:
        wrong.append(what)
        print("WRONG:", what)


class Ranks:
    def __init__(self, program, sources, folder):
        self.program, self.sources, self.folder = program, pathlib.Path(sources), pathlib.Path(folder)
        self.scripts = self.sources / "ci/cluster"

    def run(self, command, **environment):
        kept = {name: value for name, value in os.environ.items() if not OURS.match(name)}
        # As root, which containers and CI often are, mpirun wants to be asked twice.
        kept.update(CUTPROOF=self.program, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
        kept.update({name: str(value) for name, value in environment.items()})
        return subprocess.run([str(word) for word in command], cwd=self.folder, env=kept, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def expect_status(self, status, command, **environment):
        done = self.run(command, **environment)
        expect(done.returncode == status, f"{command} with {environment} ended with {done.returncode}, not {status}:\n"
                                          f"{done.stdout}")
        return done.stdout

    def shard(self, results, **environment):
        return self.expect_status(0, [self.scripts / "fuzz_shard.sh", results, *CAMPAIGN], **environment)

    def merge(self, results, status):
        shards = sorted((self.folder / results).glob("shard_*.json"))
        text = self.expect_status(status, [self.program, "fuzz", "--merge", *shards, "--json", "merged.json"])
        return text, self.read("merged.json")

    def read(self, name):
        return json.loads((self.folder / name).read_text())

    def whole(self):
        self.expect_status(0, [self.program, "fuzz", *CAMPAIGN, "--json", "one.json"])
        return self.read("one.json")

    def write_losing(self, lost, with_rank=False):
        """A program that dies, as one does that a machine runs out of memory for, when it is to judge shard `lost`;
        `with_rank`: and with it all of its rank, while the others are at work."""
        path = self.folder / f"losing_{lost}"
        die, others = "kill -9 $$", ":"
        if with_rank:
            die = "kill -9 $(awk '/^PPid/ {print $2}' /proc/$PPID/status) $PPID $$"
            others = "sleep 2"
        path.write_text(f'#!/bin/sh\ncase "$*" in *"--shard {lost}/"*) {die} ;; *--shard*) {others} ;; esac\n'
                        f'exec "{self.program}" "$@"\n')
        path.chmod(0o755)
        return path


def same(document):
    kept = {name: value for name, value in document.items() if name not in TIMES + DIVISION}
    return kept | {"properties": [{name: value for name, value in each.items() if name not in TIMES}
                                  for each in document["properties"]]}


def expect_same(one, merged, what):
    expect(one["cases"] == 90 and one["verdicts"] > 1000, "the campaign has judged too little for this test")
    expect(merged["complete"] is True and merged["missing_shards"] == [], f"{what}: it is not complete")
    differing = [name for name in same(one).keys() | same(merged).keys() if same(one).get(name) != same(merged).get(name)]
    expect(not differing, f"{what}: these differ from one rank's: {differing}")


def slurm(ranks):
    one = ranks.whole()
    # Slurm runs a copy, in the folder from which it was submitted.
    spool = ranks.folder / "spool"
    spool.mkdir()
    job = shutil.copy(ranks.scripts / "fuzz.slurm", spool / "slurm_script")

    def element(task, first, last, status=0, arguments=CAMPAIGN, **more):
        environment = dict(SLURM_SUBMIT_DIR=ranks.sources, SLURM_ARRAY_JOB_ID=17, SLURM_ARRAY_TASK_ID=task,
                           SLURM_ARRAY_TASK_MIN=first, SLURM_ARRAY_TASK_MAX=last,
                           SLURM_ARRAY_TASK_COUNT=last - first + 1, SLURM_CPUS_PER_TASK=1, SLURM_PROCID=0,
                           SLURM_NTASKS=1)
        environment.update(more)
        return ranks.expect_status(status, [job, *arguments], **environment)

    for task in range(1, 5):
        element(task, 1, 4)
    expect_same(one, ranks.merge("fuzz_17", 0)[1], "a job array of 4")
    # It may be counted from anywhere.
    for task in range(10, 13):
        element(task, 10, 12, CUTPROOF_RESULTS="from_10")
    expect_same(one, ranks.merge("from_10", 0)[1], "a job array from 10 to 12")

    # An element that is lost: its shard is named, and that one alone is run again.
    losing = ranks.write_losing(3)
    for task in range(1, 5):
        element(task, 1, 4, 137 if task == 3 else 0, CUTPROOF=losing, CUTPROOF_RESULTS="lost")
    text, merged = ranks.merge("lost", 1)
    expect("missing 3;" in text, f"the merge does not name the lost shard:\n{text}")
    expect(merged["complete"] is False and merged["missing_shards"] == [3] and merged["holds"] is False,
           "an incomplete campaign passes as complete")
    expect(0 < merged["cases"] < 90, "the cases of a lost shard are counted")
    element(3, 3, 3, CUTPROOF_SHARDS=4, CUTPROOF_RESULTS="lost")
    expect_same(one, ranks.merge("lost", 0)[1], "the lost element run again")
    # What an earlier run left does not stand for one that is lost.
    element(3, 1, 4, 137, CUTPROOF=losing, CUTPROOF_RESULTS="lost")
    expect(ranks.merge("lost", 1)[1]["missing_shards"] == [3], "an old result stands for a lost shard")

    # Others that start ranks.
    ways = {"srun": ("SLURM_PROCID", "SLURM_NTASKS"), "mpiexec": ("PMI_RANK", "PMI_SIZE"),
            "mpirun": ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE")}
    for name, (rank_in, size_in) in ways.items():
        for rank in range(2):
            ranks.shard(name, **{rank_in: rank, size_in: 2})
        expect_same(one, ranks.merge(name, 0)[1], name)
    for shard in ("1/2", "2/2"):
        ranks.shard("by_hand", CUTPROOF_SHARD=shard, OMPI_COMM_WORLD_RANK=7, OMPI_COMM_WORLD_SIZE=9)
    expect_same(one, ranks.merge("by_hand", 0)[1], "CUTPROOF_SHARD")

    # What would judge other cases than were asked for is refused.
    for what, said in ((dict(SLURM_ARRAY_TASK_COUNT=2), "CUTPROOF_SHARDS"), (dict(SLURM_PROCID=1), "--ntasks"),
                       (dict(SLURM_ARRAY_TASK_ID="x"), "SLURM_ARRAY_TASK_ID"), (dict(CUTPROOF_SHARD="2"), "I/N"),
                       (dict(CUTPROOF_SHARD="3/2"), "--shard"), (dict(arguments=["--shard", "1/2"]), "--shard"),
                       (dict(SLURM_SUBMIT_DIR="nowhere"), "CUTPROOF_CLUSTER")):
        text = element(2, 1, 3, 2, CUTPROOF_RESULTS="refused", **what)
        logs = "".join(log.read_text() for log in (ranks.folder / "refused").glob("*.log"))
        expect(said in text + logs, f"{what} is refused without '{said}':\n{text}{logs}")
    text = ranks.expect_status(2, [ranks.scripts / "fuzz_shard.sh", "refused", *CAMPAIGN])
    expect("CUTPROOF_SHARD" in text, f"nothing says which shard it is:\n{text}")
    expect(not list((ranks.folder / "refused").glob("*.json")), "something refused has left a result")


def mpirun(ranks):
    version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True).stdout if shutil.which("mpirun") else ""
    if "Open MPI" not in version:
        print("SKIPPED: there is no mpirun of Open MPI (Debian package openmpi-bin): campaigns under it were not tested")
        sys.exit(77)
    one = ranks.whole()
    script = ranks.scripts / "fuzz_mpi.sh"
    with_three = ["--", "-n", "3", "--oversubscribe"]
    for ranks_of in (1, 3):
        ranks.expect_status(0, [script, f"of_{ranks_of}", *CAMPAIGN, "--", "-n", str(ranks_of), "--oversubscribe"])
        merged = ranks.read(f"of_{ranks_of}/whole.json")
        expect(merged["merged_shards"] == ranks_of, f"mpirun -n {ranks_of} ran {merged['merged_shards']} shards")
        expect_same(one, merged, f"mpirun -n {ranks_of}")
    text = ranks.expect_status(1, [script, "lost", *CAMPAIGN, *with_three], CUTPROOF=ranks.write_losing(2))
    expect("missing 2;" in text, f"the lost rank is not named:\n{text}")
    merged = ranks.read("lost/whole.json")
    expect(merged["complete"] is False and merged["missing_shards"] == [2], "a lost rank passes as complete")
    # A rank that is killed, and not its program alone, does not take the others along.
    text = ranks.expect_status(1, [script, "killed", *CAMPAIGN, *with_three], CUTPROOF=ranks.write_losing(3, True))
    expect("shard 2 of 3: exit status 0" in text and "shard 3 of 3: exit status" not in text,
           f"not all of a rank was killed, so this tests nothing:\n{text}")
    merged = ranks.read("killed/whole.json")
    expect(merged["missing_shards"] == [3], f"of 3 ranks the last was killed: {merged['missing_shards']} are missing")
    ranks.shard("lost", CUTPROOF_SHARD="2/3")
    expect_same(one, ranks.merge("lost", 0)[1], "the lost rank run again")
    text = ranks.expect_status(2, [script, "of_3", *CAMPAIGN, *with_three])
    expect("of_3" in text, f"a folder with other results is refused without its name:\n{text}")


def main():
    way, program, sources = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        {"slurm": slurm, "mpirun": mpirun}[way](Ranks(program, sources, folder))
    print(f"{way}: " + ("all as it should be" if not wrong else f"{len(wrong)} things are wrong"))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
