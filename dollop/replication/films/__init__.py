"""Films of what the paper tells: python -m dollop.replication.films [name ...].

Each film is one function that yields its frames, in the modules named after what they show: the
lab's camera beside the map. This one writes a file per film, and shows it in a notebook.
"""

import argparse
import base64
import html
import sys
from dataclasses import dataclass
from pathlib import Path

import joblib
from tqdm import tqdm

from dollop.checks import check_choice, checked_number, checked_whole, need
from dollop.formats.kinds import GIF, Kind
from dollop.formats.writing import check_writable, whole_file
from dollop.replication.films import driving, loop, merging, showing  # noqa: F401
from dollop.replication.films.encoding import encoded, need_av
from dollop.replication.films.reel import REEL

__all__ = ["FILMS", "film", "main", "show"]

ORDER = "shown", "performed", "kidnapped", "moved_cans", "slalom", "merging", "dollop"
FILMS = {name: REEL[name] for name in ORDER}
"""Every film by name, in the paper's order, and the loop of the README."""

MP4 = Kind("a film", rb"\A....ftyp")
KINDS = {".mp4": MP4, ".gif": GIF}
TYPES = {".mp4": "video/mp4", ".gif": "image/gif"}
WIDTHS, LONGEST, WIDTH = (160, 3840), 120.0, {".mp4": 960, ".gif": 800}
"""Pixels and s that a film may have, and pixels that it has when nobody says otherwise."""
LONGEST_FIRST = "shown", "dollop", "kidnapped"
"""Which films are begun first, so that no core waits for another at the end."""

DESCRIPTION = "Make the films named, or all."


@dataclass(frozen=True)
class Page:
    """A piece of HTML, which a notebook shows where it is the result of a cell.

    Attributes
    ----------
    data : str
    """

    data: str

    def _repr_html_(self):
        return self.data


def film(name, folder="films", width=None, seconds=None):
    """Make one film, from nothing but seeds.

    Parameters
    ----------
    name : str
        A key of `FILMS`.
    folder : str or Path
        Where it is written; made if it is not there.
    width : int, optional
        Pixels, an even number of 160 to 3840; 960 when not given, and 800 of the loop.
    seconds : float, optional
        Its length, at most 120 s: what it shows is sped up for it. Its own when not given.

    Returns
    -------
    Path
        The file, whole.

    Raises
    ------
    ValueError
        An unknown name, a width or a length that is none.
    ImportError
        PyAV or PyBullet is missing.
    OSError
        The folder cannot be written to; told before the work.
    """
    check_choice("name", name, FILMS)
    each = FILMS[name]
    width, count = checked_size(each, width, seconds)
    check_installed()
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / each.file
    check_writable(path, KINDS[each.suffix])
    look = {"desc": name, "unit": "frame", "file": sys.stderr, "leave": False}
    frames = tqdm(each.draw(width, count), total=count, **look)
    content = encoded(frames, each.suffix, each.rate)
    with whole_file(path, kind=KINDS[each.suffix]) as stream:
        stream.write(content)
    return path


def checked_size(each, width, seconds):
    """Width in pixels and number of frames of a film, as asked for."""
    width = checked_whole("width", WIDTH[each.suffix] if width is None else width, *WIDTHS)
    if width % 2:
        raise ValueError(f"width must be even, got {width}")
    seconds = checked_number("seconds", each.seconds if seconds is None else seconds, 0.5, LONGEST)
    return width, round(seconds * each.rate)


def check_installed():
    """Refuse to begin where what films need is missing."""
    need("lab")
    need_av()


def show(name, folder="../films"):
    """A film where a notebook shows it, with what it shows in words; it plays without a network.

    Parameters
    ----------
    name : str
        A key of `FILMS`.
    folder : str or Path
        Where it was written.

    Returns
    -------
    Page
        Where there is no such film, how to make it.
    """
    check_choice("name", name, FILMS)
    each, path = FILMS[name], Path(folder) / FILMS[name].file
    title, words = html.escape(each.title), html.escape(each.words)
    if not path.is_file():
        missing = f"The film <em>{title}</em> is not in <code>{html.escape(str(folder))}</code>"
        return Page(f"<p>{missing}: <code>make films</code> makes it. {words}</p>")
    data = f"data:{TYPES[each.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"
    look = 'style="width: 100%; max-width: 960px; height: auto"'
    if each.suffix == ".gif":
        picture = f'<img src="{data}" alt="{words}" {look}>'
    else:
        how = f'controls loop muted playsinline aria-label="{words}" {look}'
        picture = f'<video src="{data}" {how}>{words}</video>'
    below = f"<figcaption><em>{title}.</em></figcaption>"
    return Page(f'<figure style="margin: 0">{picture}{below}</figure>')


def main(arguments=None):
    """Make the films named, or all; the command line of `python -m dollop.replication.films`.

    A film is written whole or not at all: after an interrupt those that are done are there.

    Parameters
    ----------
    arguments : list of str, optional
        By default those that the program was called with.

    Raises
    ------
    SystemExit
        An unknown name, a width or length that is none, or a folder that cannot be written to: told
        before the work.
    ImportError
        PyAV or PyBullet is missing: told before the work as well.
    KeyboardInterrupt
        When interrupted, with how many films are done.
    """
    program, known = "python -m dollop.replication.films", ", ".join(FILMS)
    parser = argparse.ArgumentParser(prog=program, description=DESCRIPTION)
    parser.add_argument("names", nargs="*", metavar="name", help=f"any of {known}; default: all")
    parser.add_argument("--folder", type=Path, default=Path("films"), help="default: films")
    parser.add_argument("--width", type=int, help="in pixels, even; default: 960, of the loop 800")
    parser.add_argument("--seconds", type=float, help="length; default: each film's own")
    told = "films made at a time; default: 2"
    parser.add_argument("--jobs", type=int, default=2, choices=range(1, 9), help=told)
    options = parser.parse_args(arguments)
    names = options.names or list(FILMS)
    if unknown := [name for name in names if name not in FILMS]:
        parser.error(f"no film {', '.join(unknown)}; known: {known}")
    check_installed()
    try:
        for name in names:
            checked_size(FILMS[name], options.width, options.seconds)
        options.folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            check_writable(options.folder / FILMS[name].file, KINDS[FILMS[name].suffix])
    except ValueError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"the folder {options.folder} cannot be written to: {error}")
    make_all(sorted(names, key=lambda name: name not in LONGEST_FIRST), options)


def make_all(names, options):
    """Make films, several at a time, and say what was written."""
    told = options.folder, options.width, options.seconds
    calls = (joblib.delayed(film)(name, *told) for name in names)
    jobs, written = min(options.jobs, len(names)), []
    at_once = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")(calls)
    bar = tqdm(at_once, total=len(names), desc="films", unit="film", file=sys.stderr)
    try:
        for path in bar:
            written.append(path)
    except KeyboardInterrupt:
        bar.close()
        raise KeyboardInterrupt(f"{len(written)} of {len(names)} films are done") from None
    for path in sorted(written):
        print(f"wrote {path}, {path.stat().st_size / 1e6:.2f} MB")
