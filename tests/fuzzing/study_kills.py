"""Studies killed at random moments, alone and several at once: what was done must stay done.

    python tests/fuzzing/study_kills.py --kills 100 --seed 0

A toy study of short jobs, each of which leaves a mark when it begins, is started, and it or one of
its workers is killed, again and again until the kills are spent; then it is let go to its end.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

from dollop.replication.ledger import Ledger
from dollop.replication.running import run_all

CLAIMS = "one", "two", "three"
WORKERS = 2
CODE = "0123456789ab"
OWN = "marks", "marks.txt", "results.csv"
"""Files of the harness itself, and the table."""


def ledger_in(folder):
    """The toy study's table."""
    return Ledger(Path(folder) / "results.csv", ("claim", "seed", "numbers", "code"), 2, "numbers")


def answers(row):
    """Whether a row has a number of the code of today."""
    return row["code"] == CODE and row["numbers"].startswith("value=")


def job_of(folder, wait, job):
    """A job: a mark that it has begun, a while, and a number that hangs on the job alone."""
    handle, _ = tempfile.mkstemp(prefix=f"{job[0]}-{job[1]}-", dir=Path(folder) / "marks")
    os.close(handle)
    time.sleep(wait)
    return {"numbers": value_of(job)}


def value_of(job):
    """What a job must find."""
    return f"value={CLAIMS.index(job[0]) + 10 * int(job[1])}"


def jobs_of(seeds):
    """The jobs of some seeds, in order."""
    return [(claim, str(seed)) for seed in seeds for claim in CLAIMS]


def run(folder, first, last, wait):
    """The toy study, in this process and its workers."""
    work = partial(job_of, folder, wait)
    run_all(ledger_in(folder), jobs_of(range(first, last)), answers, lambda job: {"code": CODE}, work, workers=WORKERS)


def start(folder, first, last, wait=0.02):
    """The toy study in a process of its own."""
    (Path(folder) / "marks").mkdir(exist_ok=True)
    call = [sys.executable, __file__, "--run", str(folder), str(first), str(last), str(wait)]
    with open(Path(folder) / "marks.txt", "ab") as told:
        return subprocess.Popen(call, stderr=told)


def is_fair_end(study, folder):
    """Whether a study ended as it may: well, killed, or with a job set aside whose worker was killed three times."""
    if study.returncode == 1:
        return "killed its worker 3 times" in (Path(folder) / "marks.txt").read_text().splitlines()[-1]
    return study.returncode in (0, -signal.SIGKILL)


def children(pid):
    """The processes that a process has started."""
    try:
        return [int(each) for each in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def workers_of(pid):
    """Those of them that do jobs: the others keep the system's books."""
    return [each for each in children(pid) if b"popen_loky" in command_of(each)]


def command_of(pid):
    """The command line of a process."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def done_in(folder):
    """The jobs that the table answers, and how many of its lines are damaged."""
    ledger = ledger_in(folder)
    rows, damaged = ledger.read()
    for row in rows:
        assert not answers(row) or row["numbers"] == value_of(ledger.job(row)), row
    return {ledger.job(row) for row in rows if answers(row)}, damaged


def wait_for_work(folder, rng):
    """Wait for a moment to kill: mostly one of work, some of starting."""
    marks = len(os.listdir(Path(folder) / "marks"))
    until = time.monotonic() + (5.0 if rng.random() < 0.8 else rng.uniform(0.0, 1.5))
    while time.monotonic() < until and len(os.listdir(Path(folder) / "marks")) == marks:
        time.sleep(0.002)
    time.sleep(rng.uniform(0.0, 0.3))


def killed_study(folder, kills, seed, n_seeds=30, at_once=1):
    """Kill studies in a folder until the kills are spent, and let them end.

    Parameters
    ----------
    folder : Path
    kills : int
    seed : int
        Of the moments and of who is killed.
    n_seeds : int
        Of the study.
    at_once : int
        The number of studies that run at a time, all on the same seeds.

    Returns
    -------
    dict
        "kills", "lost" rows, jobs "repeated" beyond the first time, and the most that may be,
        "torn" lines that were found, "missing" jobs at the end, files "left" beside the table, and
        studies that set jobs "aside" which were killed three times.
    """
    rng = np.random.default_rng(seed)
    done, lost, torn, spent = set(), set(), 0, 0
    first, last, allowed = 0, n_seeds, 0
    studies = [start(folder, first, last) for _ in range(at_once)]
    while True:
        ended = [study for study in studies if study.poll() is not None]
        if spent >= kills and len(ended) == at_once:
            break
        if spent >= kills:
            time.sleep(0.05)
            continue
        for study in ended:  # all is done: there must be more to do for what is killed
            assert is_fair_end(study, folder), (Path(folder) / "marks.txt").read_text()[-2000:]
            last += n_seeds if study.returncode == 0 and study is ended[0] else 0
            studies[studies.index(study)] = start(folder, first, last)
        wait_for_work(folder, rng)
        study = studies[rng.integers(at_once)]
        victims = [study.pid, *workers_of(study.pid)]
        victim = victims[rng.integers(len(victims))]
        try:
            os.kill(victim, signal.SIGKILL)
        except ProcessLookupError:
            continue
        if victim == study.pid:
            study.wait()
        spent += 1
        allowed += WORKERS if victim == study.pid else 1
        now, damaged = done_in(folder)
        lost |= done - now
        done, torn = done | now, torn + damaged
    last_study = start(folder, first, last)
    assert last_study.wait() == 0
    now, _ = done_in(folder)
    marks = len(list((Path(folder) / "marks").iterdir()))
    left = sorted(path.name for path in Path(folder).iterdir() if path.name not in OWN)
    wanted = set(jobs_of(range(first, last)))
    return {
        "kills": spent, "jobs": len(wanted), "lost": len(lost | (done - now)), "missing": len(wanted - now),
        "repeated": marks - len(wanted), "allowed": allowed, "torn": torn, "left": left,
        "aside": (Path(folder) / "marks.txt").read_text().count("jobs were set aside"),
    }  # fmt: skip


def main():
    """Kill, and tell what came of it; exit status 1 if a row was lost, or more repeated than may be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", nargs=4)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--at-once", type=int, default=1)
    options = parser.parse_args()
    if options.run:
        folder, first, last, wait = options.run
        run(folder, int(first), int(last), float(wait))
        return
    with tempfile.TemporaryDirectory() as folder:
        found = killed_study(folder, options.kills, options.seed, at_once=options.at_once)
    print(found)
    wrong = found["lost"] or found["missing"] or found["left"] or found["repeated"] > found["allowed"]
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
