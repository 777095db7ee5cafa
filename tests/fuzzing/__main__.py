"""A longer run, as `make fuzz` has it: python tests/fuzzing --files 100000 --calls 6000 --seed 0.

Failures are kept under build/fuzz, one folder for each cause, with the command that does it again:
python tests/fuzzing --again "KIND" SEED INDEX.
"""

import argparse
import collections
import shutil
import sys
import time
from pathlib import Path

import calls
import kinds
from watch import bounded, watch_all, watched

from dollop.checks import told

CALLS = calls.NUMBERS, calls.RECORDS
VERDICTS = "accepted", "refused", "failed"


def main():
    """Run what the command line asks for; exit status 1 if there is a failure."""
    options = parsed()
    if options.again:
        name, seed, index = options.again
        sys.exit(again((name, int(seed), int(index)), options.input))
    names = options.kinds or kinds.there()
    for name in names:
        kinds.seeds_of(name)  # before any process is forked
    if options.calls:
        calls.calls()
    wrong, begin, each = 0, time.monotonic(), -(-options.files // len(names))
    for seed in options.seed:
        pieces = [(name, seed, index) for name in names for index in range(each)]
        pieces += [(kind, seed, index) for kind in CALLS for index in range(options.calls)]
        wrong += run(pieces, options)
        done = len(pieces) * (options.seed.index(seed) + 1)
    spent = time.monotonic() - begin
    print(f"{done} in {spent:.0f} s, {done / spent:.0f} per second")
    sys.exit(wrong > 0)


def parsed():
    """The command line."""
    parser = argparse.ArgumentParser(prog="python tests/fuzzing", description=__doc__)
    add = parser.add_argument
    add("--files", type=int, default=1000, help="how many damaged files for each seed, of all kinds together")
    add("--calls", type=int, default=0, help="how many hostile calls for each seed")
    add("--seed", type=int, nargs="+", default=[0])
    add("--kinds", nargs="+", choices=list(kinds.KINDS), metavar="KIND", help=", ".join(kinds.KINDS))
    add("--workers", type=int, default=1)
    add("--memory", type=float, default=1.0, metavar="GIB", help="that a process may have more than at its beginning")
    add("--folder", type=Path, default=Path("build/fuzz"), help="for what fails")
    add("--input", type=Path, metavar="FOLDER", help="with --again: the files as they were kept, not made anew")
    add("--again", nargs=3, metavar=("KIND", "SEED", "INDEX"), help="one file, with all that is known of it")
    return parser.parse_args()


def do(piece):
    """Do one piece of work: a damaged file or a hostile call."""
    (calls.one_call if piece[0] in CALLS else kinds.one)(piece)


def run(pieces, options):
    """Do pieces of one seed; prints a table and returns how many failed."""
    found, causes = collections.defaultdict(collections.Counter), collections.Counter()
    slowest = collections.Counter()
    for piece, outcome in watch_all(do, pieces, options.workers, int(options.memory * 2**30)):
        found[piece[0]][outcome.verdict] += 1
        slowest[piece[0]] = max(slowest[piece[0]], outcome.seconds)
        if outcome.verdict == "failed":
            causes[outcome.cause] += 1
            if causes[outcome.cause] <= 3:
                keep(piece, outcome, options.folder)
    tell(found, slowest, pieces[0][1])
    for cause, times in causes.most_common():
        print(f"{times:6} x {cause}", flush=True)
    return sum(causes.values())


def keep(piece, outcome, folder):
    """Keep a file that failed, and how."""
    name = "".join(c if c.isalnum() else "-" for c in outcome.cause)[:100]
    place = Path(folder, name, "-".join(map(str, piece)).replace(" ", "_").replace(",", ""))
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    what = "" if piece[0] not in CALLS else changed(*calls.hostile_call(*piece))
    command = f'python tests/fuzzing --again "{piece[0]}" {piece[1]} {piece[2]}'
    if piece[0] not in CALLS:
        files = kinds.damaged_files(*piece)
        kinds.put(files, place / "files")
        (place / "order.txt").write_text("\n".join(files))
        command += f" --input {place / 'files'}"
    (place / "told.txt").write_text(f"{outcome.cause}\n{command}\n{what}\n{outcome.told}\n", errors="backslashreplace")


def tell(found, slowest, seed):
    """A table of kinds."""
    print(f"\n{'seed ' + str(seed):20}{'files':>8}" + "".join(f"{verdict:>10}" for verdict in VERDICTS) + "   slowest")
    total = sum(found.values(), collections.Counter())
    for name, counts in [*found.items(), ("all", total)]:
        numbers = "".join(f"{counts[verdict]:10}" for verdict in VERDICTS)
        print(f"{name:20}{sum(counts.values()):8}{numbers}{slowest[name] or max(slowest.values()):8.2f} s")


def again(piece, kept):
    """Do one piece again, in this process."""
    if piece[0] in CALLS:
        print(changed(*calls.hostile_call(*piece)))
    else:
        files = kinds.damaged_files(*piece) if kept is None else read_folder(kept)
        for name, content in files.items():
            print(f"{name}: {len(content)} bytes: {content[:300]}")
    bounded()
    begin = time.monotonic()
    outcome = watched(do, piece) if piece[0] in CALLS else watched(kinds.one, piece, files)
    print(f"{outcome.verdict} after {time.monotonic() - begin:.2f} s: {outcome.cause}\n{outcome.told}")
    return outcome.verdict == "failed"


def changed(name, arguments):
    """A call in words: its hostile arguments."""
    valid = calls.calls()[name].arguments
    return f"{name} with " + ", ".join(f"{k}={told(v)}" for k, v in arguments.items() if v is not valid[k])


def read_folder(folder):
    """The files of a folder, {name: content}, as they were put there: what is read first comes first."""
    order = [line for line in (folder.parent / "order.txt").read_text().splitlines() if (folder / line).is_file()]
    return {name: (folder / name).read_bytes() for name in order}


if __name__ == "__main__":
    main()
