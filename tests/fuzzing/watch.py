"""Watching work on hostile input: it is right, or refused in words; all else is a failure.

Each piece runs in a process of its own kind: forked, with a bound on memory and an alarm, so that one that
hangs or dies costs itself and no other.
"""

import dis
import multiprocessing
import resource
import signal
import sys
import time
import traceback
import warnings
from collections import namedtuple
from functools import partial
from multiprocessing.connection import wait
from pathlib import Path

import dollop

SECONDS, BYTES, LONGEST = 10.0, 2**30, 300
"""What one piece of work may take: s, bytes beyond those that the process begins with, characters of a message."""
LIBRARY, HERE = Path(dollop.__file__).parent, Path(__file__).parent
AT_ONCE = 500
"""Pieces of work that one process does before another takes its place."""
FOREIGN = (
    "broadcast", "reshape", "operands", "ambiguous", "inhomogeneous", "setting an array element", "out of bounds for",
    "object is not", "has no attribute", "unsupported operand", "not supported between", "not iterable", "must be str",
    "positional argument", "unexpected keyword", "required argument", "argument must be", "cannot convert",
    "too large to convert", "Lengths must match", "unpack (expected", "KeyError", "TypeError", "IndexError",
    "AttributeError",
)  # fmt: skip
"""What numpy, pandas and Python say of the code and not of the file: caught, it is still no word of the library."""
QUOTED = "not a readable ROS bag ("
"""What begins a message that says with whose words it goes on: those of rosbags."""
RAISE = dis.opmap["RAISE_VARARGS"]

Outcome = namedtuple("Outcome", "verdict cause told seconds", defaults=("", "", 0.0))
"""accepted, refused or failed; of a failure its cause, the same for all of one kind, and all that is known; time."""


class Wrong(Exception):
    """Something was accepted, but what came of it is not right."""


class TooLong(BaseException):
    """The alarm."""


# ---- judging


def frames_of(error):
    """All frames from where an error was caught to where it was raised."""
    return list(traceback.walk_tb(error.__traceback__))


def by_the_library(error):
    """Whether an error was raised by a line of the library that raises, and not by something that the line calls."""
    frame = error.__traceback__
    while frame.tb_next:
        frame = frame.tb_next
    code = frame.tb_frame.f_code
    return Path(code.co_filename).is_relative_to(LIBRARY) and code.co_code[frame.tb_lasti] == RAISE


def chain_of(error):
    """The error and all that it was raised from, or while handling."""
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def fault(error):
    """What is wrong with an error as an answer to hostile input; nothing if it is a refusal in words."""
    if isinstance(error, FileNotFoundError):
        return fault_of_text(str(error))  # it names the file
    if not isinstance(error, ValueError):
        return type(error).__name__
    if any(isinstance(each, MemoryError) for each in chain_of(error)):
        return "MemoryError, caught"
    if not by_the_library(error):
        return f"raw {type(error).__name__}"
    return fault_of_text(str(error))


def fault_of_text(text):
    """What is wrong with a message; nothing if it is one line of at most 300 characters, in words of the library."""
    if len(text) > LONGEST:
        return "a message too long"
    for words in FOREIGN:
        if words in text and QUOTED not in text:
            return f"a message with the words of others, '{words}',"
    return "" if text.isprintable() else "a message of several lines, or not printable"


def place_of(frames):
    """The innermost place in the library among frames, without the line, which moves with every change."""
    inside = [frame for frame, _ in frames if Path(frame.f_code.co_filename).is_relative_to(LIBRARY)]
    if not inside:
        return "outside of the library"
    return f"{Path(inside[-1].f_code.co_filename).relative_to(LIBRARY)}:{inside[-1].f_code.co_name}"


def failed(error, what):
    """The outcome of an error that is none in words."""
    told = "".join(traceback.format_exception(error, limit=-12))
    return Outcome("failed", f"{what} in {place_of(frames_of(error))}", told[-6000:])


def pushed(step, *arguments, **options):
    """What a further step makes of something accepted; None if it refuses it in words."""
    try:
        return step(*arguments, **options)
    except ValueError as error:
        if fault(error):
            raise
        return None


class Heard:
    """Warnings of a piece of work, each with the innermost place in the library that it came from."""

    def __init__(self):
        self.wrong = None

    def __call__(self, message, category, filename, lineno, *_):
        own = issubclass(category, UserWarning) and Path(filename).is_relative_to(HERE)
        what = fault_of_text(str(message)) if own else f"{category.__name__} from the depth"
        if what and not self.wrong:
            frames = list(traceback.walk_stack(sys._getframe()))[::-1]
            told = f"{filename}:{lineno}: {str(message)[:2000]}"
            self.wrong = Outcome("failed", f"{what} in {place_of(frames)}", told)


def ring(*_):
    """The alarm goes off."""
    raise TooLong


def watched(work, *arguments):
    """What comes of a piece of work: an `Outcome`.

    Who calls it must be in the main thread; memory is bounded by `bounded`.
    """
    signal.signal(signal.SIGALRM, ring)
    heard, begin = Heard(), time.monotonic()
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = heard
        try:
            signal.setitimer(signal.ITIMER_REAL, SECONDS)
            work(*arguments)
            outcome = Outcome("accepted")
        except TooLong as error:
            outcome = failed(error, f"more than {SECONDS:g} s")
        except Wrong as error:
            outcome = Outcome("failed", f"wrong: {error.args[0]}", "".join(traceback.format_exception(error, limit=-6)))
        except (Exception, SystemExit) as error:
            what = fault(error)
            outcome = failed(error, what) if what else Outcome("refused", "", str(error))
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
    outcome = outcome if outcome.verdict == "failed" else heard.wrong or outcome
    return outcome._replace(seconds=time.monotonic() - begin)


# ---- many


def bounded(extra=BYTES):
    """Let this process have so many bytes more than it has (on Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + extra
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))


def do_some(answer, work, pieces, extra):
    """In a process of its own: what comes of each piece, told one by one."""
    bounded(extra)
    for piece in pieces:
        answer.send((piece, watched(work, piece)))
    answer.close()


class Worker:
    """A process that does some pieces of work."""

    def __init__(self, work, extra, pieces):
        fork = multiprocessing.get_context("fork")
        self.pieces, self.done, self.heard = pieces, 0, time.monotonic()
        self.answers, answer = fork.Pipe(duplex=False)
        self.process = fork.Process(target=do_some, args=(answer, work, pieces, extra), daemon=True)
        self.process.start()
        answer.close()

    def outcome(self):
        """The next piece and its outcome; None for both if the process has ended."""
        try:
            piece, found = self.answers.recv()
        except EOFError:
            return None, None
        self.heard, self.done = time.monotonic(), self.pieces.index(piece, self.done) + 1
        return piece, found

    def end(self):
        """Stop the process if it has not stopped, and tell what was under way, with the reason."""
        hung = self.process.is_alive() and time.monotonic() - self.heard > 2 * SECONDS
        if hung:
            self.process.kill()
        self.process.join()
        self.answers.close()
        if self.done == len(self.pieces):
            return None, None
        what = f"more than {SECONDS:g} s, and deaf to the alarm" if hung else "a dead worker"
        return self.pieces[self.done], Outcome("failed", what, f"exit status {self.process.exitcode}")


def watch_all(work, pieces, workers=1, extra=BYTES):
    """What comes of each piece of work, (piece, Outcome) in the order in which they end."""
    chunks = [pieces[i : i + AT_ONCE] for i in range(0, len(pieces), AT_ONCE)][::-1]
    start, running = partial(Worker, work, extra), []
    while chunks or running:
        while chunks and len(running) < workers:
            running.append(start(chunks.pop()))
        ready = wait([each.answers for each in running], timeout=1.0)
        for worker in list(running):
            ended = time.monotonic() - worker.heard > 2 * SECONDS
            if worker.answers in ready:
                piece, found = worker.outcome()
                ended = found is None
                if found:
                    yield piece, found
            if ended:
                running.remove(worker)
                piece, found = worker.end()
                if found:
                    yield piece, found
                    chunks.append(worker.pieces[worker.done + 1 :])
