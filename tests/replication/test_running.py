"""Running jobs: killed at any moment, several studies at once, jobs without an end; nothing is lost or done twice."""

import os
import signal
import time

import pytest
from fuzzing.study_kills import CODE, answers, done_in, job_of, jobs_of, killed_study, ledger_in, run, start

from dollop.replication import running
from dollop.replication.running import run_all


def marks_in(folder):
    """How many jobs were begun."""
    return len(list((folder / "marks").iterdir()))


@pytest.mark.parametrize(("seed", "at_once"), [(0, 1), (1, 3)])
def test_studies_that_are_killed_lose_nothing(tmp_path, seed, at_once):
    """Two kills of studies and workers: every row stays, at most the jobs under way are repeated, nothing is left."""
    found = killed_study(tmp_path, 2, seed, at_once=at_once)
    assert found["kills"] == 2 and found["jobs"] >= 90
    assert found["lost"] == found["missing"] == 0 and found["left"] == []
    assert found["repeated"] <= found["allowed"]


def test_two_studies_in_one_folder_share_the_work(tmp_path):
    """On seeds that overlap each ends with its rows in the table, and no job is done twice."""
    studies = [start(tmp_path, first, first + 20, 0.01) for first in (0, 5)]
    assert [study.wait() for study in studies] == [0, 0]
    assert done_in(tmp_path) == (set(jobs_of(range(25))), 0)
    assert marks_in(tmp_path) == 75
    assert sorted(path.name for path in tmp_path.iterdir()) == ["marks", "marks.txt", "results.csv"]


def test_rows_of_other_code_and_damaged_ones_are_made_anew(tmp_path, capsys):
    """And only they; how many is said."""
    (tmp_path / "marks").mkdir()
    run(tmp_path, 0, 5, 0.0)
    path = tmp_path / "results.csv"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:1], *lines[2:], lines[1].replace("value=0", "value=9")]) + "one,0,val")
    capsys.readouterr()
    run(tmp_path, 0, 5, 0.0)
    assert f"2 rows of {path} were damaged and are made anew" in capsys.readouterr().err
    assert marks_in(tmp_path) == 16 and path.read_text() == "".join(lines)
    work = lambda job: job_of(tmp_path, 0.0, job)  # noqa: E731
    rows = run_all(ledger_in(tmp_path), jobs_of([1]), lambda row: row["code"] == "f", lambda job: {"code": "f"}, work)
    told = capsys.readouterr().err
    assert "3 rows" in told and "12 rows" in told and "nobody asked for them" in told
    assert marks_in(tmp_path) == 19 and [row["code"] for row in rows].count(CODE) == 12


def never_ending(job):
    """A job that has no end for the seed 1."""
    time.sleep(600 if job[1] == "1" else 0)
    return {"numbers": "value=1"}


def test_a_job_without_an_end_is_set_aside(tmp_path, monkeypatch):
    """The limit is told, and all others are done, though a busy machine takes seconds to start their worker."""
    monkeypatch.setattr(running, "LIMIT", 8.0)
    jobs = [("one", str(seed)) for seed in range(4)]
    with pytest.raises(RuntimeError, match="1 jobs were set aside: claim one, seed 1: no end after 8 s"):
        run_all(ledger_in(tmp_path), jobs, answers, lambda job: {"code": CODE}, never_ending, workers=2)
    rows, _ = ledger_in(tmp_path).read()
    assert [row["seed"] for row in rows if answers(row)] == ["0", "2", "3"]


def own_id(jobs):
    """The worker's number."""
    return os.getpid()


def test_a_worker_that_dies_with_nothing_to_do_costs_nothing():
    """Another takes its place, and the next job is done there."""
    with running._lanes(None, 1) as (lane,):
        lane.start(own_id, [("one", "0")])
        first = lane.future.result()
        lane.ended()
        broken = lane.executor._flags
        os.kill(first, signal.SIGKILL)
        while broken.broken is None:
            time.sleep(0.01)
        lane.start(own_id, [("one", "1")])
        assert lane.future.result() != first


def lethal(job):
    """A job that ends its process."""
    os._exit(1)


def test_workers_that_die_whatever_they_are_at_end_the_study(tmp_path, monkeypatch):
    """After so many jobs in a row it is not the jobs."""
    monkeypatch.setattr(running, "ATTEMPTS", 3)
    with pytest.raises(RuntimeError, match="workers died over 3 jobs in a row"):
        run_all(ledger_in(tmp_path), jobs_of(range(4)), answers, lambda job: {"code": CODE}, lethal, workers=2)


def test_a_job_that_leaves_is_a_job_that_failed(tmp_path):
    """Neither sys.exit nor an error ends the study; both are told with the job."""

    def leaving(job):
        raise SystemExit(3) if job[0] == "one" else MemoryError("too much")

    message = "2 jobs were set aside: claim one, seed 0: SystemExit: 3; claim two, seed 0: MemoryError: too much"
    with pytest.raises(RuntimeError, match=message):
        run_all(ledger_in(tmp_path), jobs_of([0])[:2], answers, lambda job: {"code": CODE}, leaving, workers=0)
