"""Whatever is damaged is refused in words, or right: a short run; `make fuzz` has a longer one."""

import sys
from functools import partial

import pytest

if sys.platform != "linux":
    pytest.skip("what is hostile runs in forked processes, bounded as Linux can", allow_module_level=True)

import bombs
import calls
import kinds
from watch import watch_all, watched

SEED, FILES, BAGS, CALLS = 0, 40, 10, 200
"""How many files of each kind, fewer of bags, which take longer to read, and calls of each."""


def failures(work, pieces):
    """What failed, in words, each cause once."""
    found = {}
    for piece, outcome in watch_all(work, pieces):
        if outcome.verdict == "failed":
            found.setdefault(outcome.cause, f"{piece}: {outcome.cause}\n{outcome.told}")
    return "\n\n".join(found.values())


@pytest.mark.parametrize("name", kinds.KINDS)
def test_damaged_files_are_refused_in_words_or_right(name):
    """Damaged files are read, and used where they are accepted.

    No error but the library's own, of a line; no warning from the depth; an end within 10 s and 1 GiB; finite results.
    """
    if name not in kinds.there():
        pytest.skip(f"{kinds.KINDS[name].needs} is not installed")
    count = BAGS if kinds.KINDS[name].needs == "rosbags" else FILES
    assert not failures(kinds.one, [(name, SEED, index) for index in range(count)])


@pytest.mark.parametrize("kind", [calls.NUMBERS, calls.RECORDS])
def test_hostile_calls_are_refused_in_words_or_right(kind):
    """The same of the public names, with one argument or two that nobody should give."""
    assert not failures(calls.one_call, [(kind, SEED, index) for index in range(CALLS)])


@pytest.mark.parametrize("name", kinds.KINDS)
def test_valid_files_are_accepted(name):
    """What is damaged is right before, and comes through all that is done with it."""
    if name not in kinds.there():
        pytest.skip(f"{kinds.KINDS[name].needs} is not installed")
    found = [watched(kinds.one, (name, SEED, 0), files) for files in kinds.seeds_of(name)]
    assert {outcome.verdict for outcome in found} == {"accepted"}, found


def test_valid_calls_are_accepted():
    """And so are the arguments of which one is replaced."""
    for name, call in calls.calls().items():
        if "path" not in call.arguments:
            outcome = watched(calls.call_and_check, name, call.arguments)
            assert outcome.verdict == "accepted", f"{name}: {outcome.cause}\n{outcome.told}"


def test_bombs_are_refused():
    """Each in 200 MiB; a log that is in order is read, and no map is made of it."""
    for name, (kind, files) in bombs.bombs().items():
        work = partial(kinds.one, (kind, SEED, 0))
        ((_, outcome),) = watch_all(work, [files], extra=bombs.MEGABYTES * 2**20)
        wanted = "accepted" if name.startswith("a log of") else "refused"
        assert outcome.verdict == wanted, f"{name}: {outcome.cause}\n{outcome.told}"
