"""Running what a seed gives for many seeds, on all cores or a Dask cluster, and telling what came of it."""

import json
import sys
from contextlib import contextmanager
from functools import partial

import joblib
from tqdm import tqdm

from dollop.checks import need

__all__ = ["as_json", "going_on_in", "put_between_marks", "report_beside", "run_all"]

ATTEMPTS = 3
"""How often in a row workers may die without a seed being finished before the study gives up."""

PATIENCE = 300.0
"""On a cluster, after so many s without a seed finished a worker counts as dead: joblib's Dask
backend is silent.
"""


def run_all(todo, work, keep, scheduler=None, jobs=-1):
    """Do the work of every seed, and keep what is found as it comes.

    Parameters
    ----------
    todo : dict
        More that the work takes, by seed; emptied seed by seed.
    work : callable
        (seed, more) -> (seed, ...), in another process.
    keep : callable
        Takes what the work returns, in this process.
    scheduler : str, optional
        Address of a Dask scheduler; all cores of this machine without it.
    jobs : int
        Number of worker processes on this machine, -1 for one per core.

    Raises
    ------
    RuntimeError
        If workers kept dying.
    """
    deaths = 0
    look = {"desc": "study", "unit": "seed", "file": sys.stderr}
    bar = tqdm(total=len(todo), disable=not todo, **look)
    with bar, workers(scheduler, jobs) as done:
        while todo:
            try:
                for found in done([joblib.delayed(work)(*job) for job in todo.items()]):
                    keep(found)
                    deaths = 0
                    del todo[found[0]]
                    bar.update()
            except Exception as error:
                deaths += 1
                give_up_or_tell(error, deaths, todo)


def give_up_or_tell(error, deaths, todo):
    """Raise what is no worker's death, or one death too many; tell of any other."""
    kinds = {kind.__name__ for kind in type(error).__mro__}
    if kinds.isdisjoint(("BrokenProcessPool", "KilledWorker", "TimeoutError")):
        raise error
    tqdm.write(f"a worker died ({type(error).__name__}); {len(todo)} seeds are left", sys.stderr)
    if deaths == ATTEMPTS:
        told = f"workers died {ATTEMPTS} times in a row over the seeds {list(todo)}"
        raise RuntimeError(f"{told}; what was done is kept") from error


@contextmanager
def workers(scheduler=None, jobs=-1):
    """What runs calls and yields results as they come: processes here, or on a Dask cluster."""
    parallel = partial(joblib.Parallel, jobs, return_as="generator_unordered", batch_size=1)
    if scheduler is None:
        yield parallel()
        return
    need("cluster")
    from distributed import Client

    with Client(scheduler), joblib.parallel_config("dask"):
        yield parallel(timeout=PATIENCE)


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
