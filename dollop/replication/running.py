"""Running jobs seed by seed, on all cores or a Dask cluster, and telling what came of them."""

import json
import os
import sys
import threading
import time
from collections import Counter, deque
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from functools import partial

import joblib
from joblib.externals.loky import ProcessPoolExecutor
from tqdm import tqdm

from dollop.checks import need, shortened
from dollop.formats.kinds import Kind
from dollop.replication.fingerprint import fingerprint
from dollop.replication.ledger import NOT_DONE

__all__ = ["REPORT", "as_json", "going_on_in", "put_between_marks", "report_beside", "run_all"]

REPORT = Kind("a report", rb"\A#|<!-- \w+: begin -->")
"""REPLICATION.md."""

LIMIT = 600.0
"""s that a job may take: a hundred times the longest. One that takes longer is set aside."""

ALONE = 2
"""How often a job that has killed its worker is tried again, alone, before it is set aside."""

ATTEMPTS = 10
"""Over so many jobs in a row workers die before the study gives up: then it is not the jobs."""

POLL = 1.0
"""s between two looks at the clock, and at seeds that another study has taken."""

IDLE = 60.0
"""s without a job after which a worker ends."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""For workers: the matrices are tiny, and more threads only get into each other's way."""

WHOLE = "dollop.replication.study"
"""What a cluster must have the same code of: it imports whatever a job may be."""


def run_all(ledger, jobs, answers, stamp, work, scheduler=None, workers=-1):
    """Do the jobs that a table has no answer to, and add each to it as soon as it is done.

    The jobs of a seed follow each other in one worker, which makes what they share once. A seed
    that another study in the same folder is at is left to that, and done only if it does not get
    done there. When a worker dies, its job is tried again alone, when all others are done, and set
    aside when it has killed alone twice; one without an end after 600 s is set aside at once. A
    Dask cluster gets a seed whole, tries again by itself, and gets what it gives up job by job; it
    cannot be made to stop. What is set aside has a line in the table that says why, and is tried
    again when the study is run again.

    Parameters
    ----------
    ledger : Ledger
    jobs : list of tuple of str
        Each ends with its seed.
    answers : callable
        Whether a line of the table, {column: text}, is what is asked for.
    stamp : callable
        What is known of a job's line before it is done, {column: text}.
    work : callable
        A job's other columns, {column: text}; in another process.
    scheduler : str, optional
        Address of a Dask scheduler; this machine without it.
    workers : int
        Number of worker processes on this machine, -1 for one per core, 0 for none but this.

    Returns
    -------
    list of dict of str
        Of each job in the table the line that counts.

    Raises
    ------
    RuntimeError
        If jobs were set aside, which are named; or if workers died over one job after the other.
        All that was done is in the table.
    """
    with ledger.shared() as table:
        before, damaged = table.read()
        _tell_of_old(ledger, before, damaged, answers, set(jobs))
        course = _Course(table, jobs, answers, stamp, partial(_tried, work))
        with course.bar, _lanes(scheduler, workers) as lanes:
            course.run(lanes)
        latest = table.tidy(answers, before)
    if course.failures:
        raise RuntimeError(f"{len(course.failures)} jobs were set aside: {'; '.join(course.failures)}")
    return latest


def _tell_of_old(ledger, rows, damaged, answers, jobs):
    """Say what in the table is not believed, and what is of no use."""
    answered = {ledger.job(row) for row in rows if answers(row)}
    old = {ledger.job(row) for row in rows if not row[ledger.why].startswith(NOT_DONE)} - answered
    if damaged:
        _say(f"{damaged} rows of {ledger.path} were damaged and are made anew where they are asked for")
    if old & jobs:
        _say(f"{len(old & jobs)} rows of {ledger.path} are of other code, or lack a number, and are made anew")
    if old - jobs:
        _say(f"{len(old - jobs)} rows of {ledger.path} are of other code and stay, for nobody asked for them")


def _say(text):
    """A line on the error stream, above the bar."""
    tqdm.write(text, sys.stderr)


def _tried(work, jobs):
    """What becomes of jobs, in the worker: of each its columns or None, and the reason if none."""
    return [_one_tried(work, job) for job in jobs]


def _one_tried(work, job):
    """What becomes of one."""
    try:
        return work(job), ""
    except (Exception, SystemExit) as error:  # whatever it is, the other jobs' results are not lost
        return None, f"{type(error).__name__}: {error}"


class _Course:
    """The course of a study: what is left to do, who is at it, and what was set aside."""

    def __init__(self, table, jobs, answers, stamp, work):
        self.table, self.answers, self.stamp, self.work = table, answers, stamp, work
        self.seeds = {}  # those that nobody has begun, with their jobs
        for job in jobs:
            self.seeds.setdefault(job[-1], []).append(job)
        self.left = {}  # the number of jobs to do, by seeds that were begun
        self.again, self.deaths, self.in_a_row = deque(), Counter(), 0
        self.failures = []
        self.bar = tqdm(total=len(jobs), disable=not jobs, desc="study", unit="job", file=sys.stderr)

    def run(self, lanes):
        """Go on until every job is done, by this study or by others, or set aside."""
        while True:
            self.fill(lanes)
            busy = {lane.future: lane for lane in lanes if lane.future}
            if not busy and not self.seeds:
                return
            if not busy:
                time.sleep(POLL)
                continue
            for future in wait(busy, POLL, FIRST_COMPLETED).done:
                self.settle(busy[future])
            for lane in busy.values():
                if lane.future and lane.late():
                    self.give_up(lane.ended(renew=True), f"no end after {LIMIT:g} s")

    def fill(self, lanes):
        """Give every lane that waits its next job; one that has killed a worker when no other is left."""
        for lane in lanes:
            if not lane.future and not lane.jobs:
                lane.jobs.extend(self.begin_seed())
            if not lane.future and lane.jobs:
                lane.start(self.work)
        if self.again and not any(lane.future for lane in lanes):
            lanes[0].start(self.work, [self.again.popleft()])

    def begin_seed(self):
        """The jobs to do of a seed that nobody is at; none if there is no such seed."""
        for seed in list(self.seeds):
            if not self.table.claim(seed):
                continue
            jobs = self.seeds.pop(seed)
            done = {self.table.ledger.job(row) for row in self.table.read()[0] if self.answers(row)}
            todo = [job for job in jobs if job not in done]
            self.bar.update(len(jobs) - len(todo))
            if todo:
                self.left[seed] = len(todo)
                return todo
            self.table.release(seed)
        return []

    def settle(self, lane):
        """Keep what a lane has found, or see why it has not."""
        if lane.future.cancelled():
            raise RuntimeError("the cluster has let go of a job; what was done is kept")
        error = lane.future.exception()
        if not error:
            self.in_a_row = 0
            for job, found in zip(lane.under_way, lane.future.result(), strict=True):
                self.finish(job, *found)
            lane.ended()
            return
        kinds = {kind.__name__ for kind in type(error).__mro__}
        if "KilledWorker" in kinds:
            self.give_up(lane.ended(), "killed its workers, says Dask")
        elif "BrokenProcessPool" in kinds:
            self.died(*lane.ended(renew=True), error)
        else:
            raise error

    def give_up(self, jobs, why):
        """Set a job aside; of several find out which."""
        if len(jobs) == 1:
            self.finish(*jobs, None, why)
        else:
            self.again.extend(jobs)
            _say(f"a worker was lost over seed {jobs[0][-1]}, whose jobs are tried one by one")

    def died(self, job, error):
        """Try a job that has killed its worker again, later and alone, or set it aside."""
        self.deaths[job] += 1
        if self.deaths[job] > ALONE:
            self.finish(job, None, f"killed its worker {self.deaths[job]} times ({ALONE} of them alone)")
            return
        self.again.append(job)
        _say(f"a worker died over {self.name(job)} ({type(error).__name__}), which is tried again alone")
        self.in_a_row += self.deaths[job] == 1
        if self.in_a_row == ATTEMPTS:
            told = f"workers died over {ATTEMPTS} jobs in a row, the last {self.name(job)}"
            raise RuntimeError(f"{told}; what was done is kept") from error

    def finish(self, job, found, why):
        """Add a job's line to the table, with what was found or with the reason why nothing was."""
        ledger, seed, why = self.table.ledger, job[-1], shortened(why)
        row = dict.fromkeys(ledger.columns, "") | self.stamp(job) | (found or {ledger.why: NOT_DONE + why})
        self.table.append(row | dict(zip(ledger.columns, job, strict=False)))
        if found is None:
            self.failures.append(f"{self.name(job)}: {why}")
            _say(f"set aside: {self.failures[-1]}")
        self.left[seed] -= 1
        if not self.left[seed]:
            self.table.release(seed)
        self.bar.update()

    def name(self, job):
        """A job in words."""
        return ", ".join(f"{name} {value}" for name, value in zip(self.table.ledger.columns, job, strict=False))


# ---- workers


class _Lane:
    """A worker with the jobs of one seed before it; when it dies another takes its place.

    Parameters
    ----------
    open_, stop, kill : callable
        What makes the worker's executor, what ends that, and what ends it whatever it is at.
    whole : bool
        Whether it gets all jobs of a seed at a time.
    """

    def __init__(self, open_, stop, kill, whole=False):
        self.open, self.stop, self.kill, self.whole = open_, stop, kill, whole
        self.executor, self.future, self.under_way, self.jobs = None, None, [], []

    def start(self, work, jobs=None):
        """Begin some jobs, or else the next."""
        if jobs is None:
            n = len(self.jobs) if self.whole else 1
            jobs, self.jobs = self.jobs[:n], self.jobs[n:]
        self.executor = self.executor or self.open()
        self.under_way, self.began = jobs, time.monotonic()
        try:
            self.future = self.executor.submit(work, jobs)
        except BrokenExecutor:  # the worker died while it had nothing to do
            self.close(self.kill)
            self.executor = self.open()
            self.future = self.executor.submit(work, jobs)

    def late(self):
        """Whether the jobs have taken longer than any may."""
        return time.monotonic() - self.began > LIMIT * len(self.under_way)

    def ended(self, renew=False):
        """The jobs, which are no longer under way."""
        self.future = None
        if renew:
            self.close(self.kill)
        return self.under_way

    def close(self, how=None):
        """End the worker, if there is one."""
        if self.executor:
            (how or self.stop)(self.executor)
        self.executor = None


@contextmanager
def _lanes(scheduler, workers):
    """The workers: processes, each apart from the others, or those of a Dask cluster."""
    with ExitStack() as stack:
        if scheduler is not None:
            lanes = _on_cluster(scheduler, stack)
        elif workers == 0:
            lanes = [_Lane(partial(ThreadPoolExecutor, 1), _shut, _shut)]
        else:
            count = joblib.cpu_count() if workers == -1 else workers
            lanes = [_Lane(_process, _kill, _kill) for _ in range(count)]
        for lane in lanes:
            stack.callback(lane.close)
        yield lanes


def _process():
    """A process that does one job at a time, without further threads, and ends with this one."""
    return ProcessPoolExecutor(1, timeout=IDLE, initializer=_end_with, initargs=(os.getpid(),), env=ONE_THREAD)


def _kill(executor):
    """End a process whatever it is at."""
    executor.shutdown(kill_workers=True)


def _shut(executor):
    """End an executor that ends by itself."""
    executor.shutdown()


def _end_with(parent):
    """End this process when the one that has started it is gone."""

    def watch():
        while os.getppid() == parent:
            time.sleep(POLL)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _on_cluster(scheduler, stack):
    """A lane for each thread of a Dask cluster, bound to none: Dask would wait for a dead one."""
    need("cluster")
    from distributed import Client

    client = stack.enter_context(Client(scheduler))
    client.wait_for_workers(1, timeout=LIMIT)
    for address, code in client.run(fingerprint, WHOLE).items():
        if code != fingerprint(WHOLE):
            raise ValueError(f"the worker {address} has other code of Dollop: {code}, here it is {fingerprint(WHOLE)}")

    lanes = sum(client.nthreads().values())
    return [_Lane(partial(client.get_executor, pure=False), _let_go, _let_go, whole=True) for _ in range(lanes)]


def _let_go(executor):
    """Take back what a cluster has been asked for."""
    executor.shutdown(wait=False)


@contextmanager
def going_on_in(path):
    """Say of what ends a study early that the same command goes on with the table at a path."""
    try:
        yield
    except RuntimeError as error:
        raise ValueError(f"{error}. Run the same command again to go on") from error
    except KeyboardInterrupt:
        done = f"what was done is in {path}, the same command goes on there"
        raise KeyboardInterrupt(done if path.exists() else "nothing was done yet") from None


# ---- telling


def report_beside(folder):
    """REPLICATION.md if the folder is that of the replication's own study beside it, else None."""
    path = folder.parent / "REPLICATION.md"
    return path if folder.name == "study" and path.exists() else None


def put_between_marks(text, name, content):
    """The text with what stands between the marks of a table replaced."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise ValueError(f"the report must hold {begin} and {end} once each")
    before, rest = text.split(begin)
    return f"{before}{begin}\n{content}\n{end}{rest.split(end)[1]}"


def as_json(content):
    """Content as JSON, a line per entry."""
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"
