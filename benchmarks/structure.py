"""Hidden Markov models set up in many ways: python -m benchmarks.structure [--seeds 10] [--jobs 2]

Which form an advocate of hmmlearn would choose: that with the largest share right in number and order from 2, 5 and 10
demonstrations of the three tasks, subgoals scattering by the spread that is told, on development seeds from 2000 on; of
those within 0.01 the most exact. Beside it, what is not chosen by: tasks of 8, 11 and 15 subgoals from two and five
demonstrations, and subgoals that scatter twice as widely as is told. Errors in m, time in s of a core.

From five seeds, with hmmlearn 0.3.3:

                                 as told                                8 to 15           twice
                                 right 2 right 5 right 10 error seconds right 2 right 5 right 5
    merging                        1.000   1.000    1.000 0.090   0.012   1.000   1.000   1.000
    ergodic, BIC                   0.867   1.000    1.000 0.094   0.084   0.267   0.667   1.000
    ergodic, mean start            0.800   1.000    1.000 0.093   0.031   0.533   0.800   1.000
    ergodic, k-means start         0.933   1.000    1.000 0.096   0.036   0.200   0.733   1.000
    ergodic, random starts         0.867   1.000    1.000 0.094   0.205   0.067   0.533   1.000
    ergodic, diagonal              0.133   0.667    1.000 0.082   0.078   0.000   0.000   0.333
    ergodic, tied                  0.400   0.867    1.000 0.087   0.175   0.000   0.200   0.400
    ergodic, AIC                   0.933   1.000    1.000 0.092   0.072   0.467   1.000   0.933
    left to right, BIC             1.000   1.000    1.000 0.093   0.081   1.000   1.000   0.933
    left to right, mean start      0.867   1.000    1.000 0.095   0.046   0.933   0.867   0.600
    left to right, random starts   0.533   0.800    0.933 0.090   0.337   0.200   0.733   0.733
    left to right, diagonal        1.000   1.000    1.000 0.100   0.071   0.867   0.933   1.000
    left to right, spherical       1.000   1.000    1.000 0.093   0.084   1.000   1.000   1.000
    left to right, tied            0.800   1.000    1.000 0.086   0.240   0.600   1.000   0.933
    left to right, AIC             1.000   1.000    1.000 0.093   0.097   1.000   1.000   0.867
    left to right, ICL             1.000   1.000    1.000 0.093   0.094   1.000   1.000   0.933
    left to right, none passed     1.000   0.867    0.933 0.129   0.154   0.733   0.867   0.867
    left to right, any passed      1.000   1.000    1.000 0.093   0.096   0.667   1.000   0.933

Fifteen seeds tell the ergodic ones apart: right 0.970 by BIC, 0.978 by AIC and from k-means; errors 0.095, 0.093 and
0.095.
"""

import argparse
from functools import partial

import pandas as pd

from dollop.lab.drawn import TASKS
from dollop.replication.baseline import Form, gaussian_hmm, merged, study

RANDOM = ("random",) * 5
FORMS = {
    "ergodic, BIC": Form(),
    "ergodic, mean start": Form(starts=("mean",)),
    "ergodic, k-means start": Form(starts=("k-means",)),
    "ergodic, random starts": Form(starts=RANDOM),
    "ergodic, diagonal": Form(covariance="diag"),
    "ergodic, tied": Form(covariance="tied"),
    "ergodic, AIC": Form(criterion="AIC"),
    "left to right, BIC": Form(1),
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
