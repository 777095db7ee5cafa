"""Hidden Markov models set up in many ways: python -m benchmarks.structure [--seeds 10] [--jobs 2]

Which form an advocate of hmmlearn would choose: that with the largest share right in number and order from 2, 5 and 10
demonstrations of the three tasks, subgoals scattering by the spread that is told, on development seeds from 2000 on; of
those within 0.01 the most exact. Beside it, what is not chosen by: tasks of 8, 11 and 15 subgoals from two and five
demonstrations, and subgoals that scatter twice as widely as is told. Errors in m, time in s of a core.
TABLE
"""

import argparse
from functools import partial

import pandas as pd

from dollop.lab.drawn import TASKS
from dollop.replication.baseline import Form, gaussian_hmm, merged, study

RANDOM = ("random",) * 5
FORMS = {
    "ergodic": Form(),
    "ergodic, mean start": Form(starts=("mean",)),
    "ergodic, k-means start": Form(starts=("k-means",)),
    "ergodic, random starts": Form(starts=RANDOM),
    "ergodic, diagonal": Form(covariance="diag"),
    "ergodic, tied": Form(covariance="tied"),
    "ergodic, AIC": Form(criterion="AIC"),
    "left to right": Form(1),
    "left to right, mean start": Form(1, starts=("mean",)),
    "left to right, random starts": Form(1, starts=RANDOM),
    "left to right, diagonal": Form(1, "diag"),
    "left to right, spherical": Form(1, "spherical"),
    "left to right, tied": Form(1, "tied"),
    "left to right, AIC": Form(1, criterion="AIC"),
    "left to right, ICL": Form(1, criterion="ICL"),
    "left to right, none passed": Form(0),
    "left to right, any passed": Form(99),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    methods = {"merging": merged} | {name: partial(gaussian_hmm, form=form) for name, form in FORMS.items()}
    seeds, rows = range(2000, 2000 + asked.seeds), {}
    cases = {"as told": (TASKS, (2, 5, 10), 0.15), "8 to 15": ((8, 11, 15), (2, 5), 0.15), "twice": (TASKS, (5,), 0.3)}
    for name, find in methods.items():
        rows[name] = {}
        for case, (tasks, numbers, spread) in cases.items():
            table = study(tasks, numbers, (spread,), seeds, {name: find}, asked.jobs)
            rows[name] |= {(case, f"right {n}"): each.right_order.mean() for n, each in table.groupby("n")}
            if case == "as told":
                rows[name] |= {(case, "error"): table.error.mean(), (case, "seconds"): table.seconds.mean()}
    print(pd.DataFrame(rows).T.to_string(float_format="%.3f"))


if __name__ == "__main__":
    main()
