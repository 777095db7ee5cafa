"""The films: committed, the same each time, refused before the work, told in words where they cannot be shown."""

import base64
import re
import sys
from io import BytesIO
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from places import DATA, ROOT

import dollop
from dollop import lab
from dollop.replication import films
from dollop.replication.films import driving, merging, showing
from dollop.replication.films.canvas import captioned, sizes, steps
from dollop.replication.films.encoding import encoded
from dollop.replication.films.reel import REEL

FOLDER = ROOT / "films"


@pytest.fixture
def av():
    """PyAV, without which there are no films."""
    return pytest.importorskip("av", reason="films need the extra films")


@pytest.fixture(scope="module")
def data():
    """The recordings in data/, which are those that the films would simulate, and what is learned from them."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    background = dollop.OccupancyGrid.load(DATA / "lab.yaml")
    eights = SimpleNamespace(recording=lab.Recording.load(DATA / "figure_eights.log.gz"))
    logs = [dollop.read_log(DATA / f"slalom_{k}.log.gz") for k in (0, 1)]
    task = dollop.learn([dollop.Demonstration.of(dollop.observe(log, background)) for log in logs])
    return SimpleNamespace(background_map=lambda: background, figure_eights=lambda: eights, slalom_task=lambda: task)


@pytest.fixture
def recorded(data, monkeypatch):
    """The films draw on these recordings."""
    for module in (showing, merging):
        monkeypatch.setattr(module, "recordings", data)


@pytest.fixture
def no_work(monkeypatch):
    """Whoever begins to draw a film fails."""

    def draw(*_):
        raise AssertionError("the work has begun")

    for each in REEL.values():
        monkeypatch.setitem(vars(each), "draw", draw)


def squares(width, count):
    """Frames that nothing has to be simulated for."""
    yield from (Image.new("RGB", sizes(width)[0], (40 * k % 256, 80, 160)) for k in range(count))


# ---- what is committed


def test_all_films_are_registered():
    """Six films and the loop of the README, none beside them."""
    assert set(films.FILMS) == set(REEL) and len(films.FILMS) == 7


@pytest.mark.parametrize("name", [name for name in films.FILMS if name != "dollop"])
def test_every_film_is_committed_at_its_length(name, av):
    """Each has the size, the length and the frames that it is made with, is small, and begins to play at once."""
    path = FOLDER / films.FILMS[name].file
    assert path.stat().st_size < 1_500_000
    content = path.read_bytes()
    assert content.index(b"moov") < content.index(b"mdat")
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == sizes(films.WIDTH[".mp4"])[0]
        assert stream.pix_fmt == "yuv420p" and not container.streams.audio
        assert stream.frames == round(films.FILMS[name].seconds * films.FILMS[name].rate)
        assert container.duration / 1e6 == pytest.approx(films.FILMS[name].seconds, abs=0.1)


def test_the_loop_is_committed():
    """It takes about eight seconds, begins anew for ever, and has at most 3 MB."""
    path = FOLDER / "dollop.gif"
    assert path.stat().st_size < 3_000_000
    with Image.open(path) as picture:
        assert picture.width == 800 and picture.info["loop"] == 0
        shown = [picture.seek(k) or picture.info["duration"] for k in range(picture.n_frames)]
    assert sum(shown) / 1000 == pytest.approx(8.0, abs=0.1)


def test_the_loop_has_no_seam():
    """From its last frame to its first no more changes than from frame to frame elsewhere."""
    with Image.open(FOLDER / "dollop.gif") as picture:
        frames = [picture.seek(k) or np.asarray(picture.convert("L"), int) for k in range(picture.n_frames)]
    changed = [np.count_nonzero(np.abs(a - b) > 20) for a, b in zip(frames, frames[1:] + frames[:1], strict=True)]
    assert changed[-1] <= np.quantile(changed[:-1], 0.95)


def test_the_readme_opens_with_the_loop():
    """Right below its title stands the film, and what it shows in words."""
    title, _, first = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()[:3]
    assert title == "# Dollop"
    found = re.fullmatch(r'<img src="films/dollop.gif" alt="([^"]+)" width="100%">', first)
    assert len(found[1]) > 100


# ---- how they are made


def test_the_same_film_twice_is_the_same_file(recorded, av, tmp_path):
    """A small and short one, from the same recordings: byte for byte."""
    first, second = (films.film("merging", tmp_path / folder, width=160, seconds=0.5) for folder in "ab")
    assert first.read_bytes() == second.read_bytes()
    with av.open(str(first)) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 10 and frames[0].shape == (74, 160, 3)
    assert np.abs(frames[0].astype(int) - frames[-1]).max() > 50  # something moves


def test_the_camera_films_the_same_twice(recorded):
    """Frames of the user who shows the task, with the camera: pixel for pixel, and no two alike."""
    first, second = (list(map(np.asarray, REEL["shown"].draw(160, 3))) for _ in range(2))
    assert np.array_equal(first, second)
    assert np.shape(first) == (3, 74, 160, 3)
    assert all((one != other).any() for one, other in pairwise(first))


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_frames_come_back(suffix, av):
    """A file has the frames that went into it, in their order."""
    content = encoded(squares(160, 6), suffix, 20)
    with av.open(BytesIO(content)) as container:
        reds = [frame.to_ndarray(format="rgb24")[40, 80, 0] for frame in container.decode(video=0)]
    assert np.abs(np.subtract(reds, [0, 40, 80, 120, 160, 200], dtype=int)).max() < 12


def test_a_film_ends_on_its_last_row():
    """Rows go evenly to the last, which stays; a frame more or less makes no difference to that."""
    for count in (1, 2, 10, 97):
        rows = steps(50, count)
        assert len(rows) == count and (np.diff(rows) >= 0).all()
    assert rows[0] == 0 and (rows[-8:] == 50).all()


def test_a_film_that_fails_leaves_the_old_one(monkeypatch, av, tmp_path):
    """Stopped in the middle, the file is as it was, and nothing lies beside it."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")

    def stopped(width, count):
        yield from squares(width, 2)
        raise KeyboardInterrupt

    monkeypatch.setitem(vars(REEL["merging"]), "draw", squares)
    path = films.film("merging", tmp_path, 160, 0.5)
    before = path.read_bytes()
    monkeypatch.setitem(vars(REEL["merging"]), "draw", stopped)
    with pytest.raises(KeyboardInterrupt):
        films.film("merging", tmp_path, 160, 0.5)
    assert list(tmp_path.iterdir()) == [path] and path.read_bytes() == before


# ---- what they say


def test_merging_is_what_the_model_has_done(recorded):
    """Merged one by one, best first, the states and their evidence are those of the task's model."""
    model = merging.recordings.slalom_task().model
    start, steps = merging.merges(model)
    assert steps[-1].evidence == pytest.approx(model.evidence)
    assert steps[-1].evidence == pytest.approx(start + sum(step.gain for step in steps))
    assert all(step.gain > 0 for step in steps)
    same = steps[-1].after[:, None] == steps[-1].after
    states = np.concatenate(model.states)
    assert (same == (states[:, None] == states)).all()


def test_every_merge_is_named(recorded):
    """The captions name the subgoals of each merge, in both demonstrations, and count them."""
    model = merging.recordings.slalom_task().model
    start, steps = merging.merges(model)
    told = [scene.caption for scene in merging.scenes(model, start, steps, 140)]
    assert len(told) == 140
    merges = {re.match(r"merge (\d+) of 6: subgoal \d of the first walk with \d of the second", each) for each in told}
    assert {int(found[1]) for found in merges if found} == set(range(1, len(steps) + 1))


def test_a_kidnapping_is_told():
    """Carried off, lost, going on, finished: the caption says which, and the robot is in the air on the way alone."""
    t = 0.1 * np.arange(5)
    poses = np.array([[0, 0, 0], [1, 0, 0], [3, 1, 0], [3, 1, 1], [4, 1, 0]], dtype=float)
    run = SimpleNamespace(
        t=t,
        true_poses=poses,
        kidnapped=np.array([0.2]),
        localised=np.array([True, True, False, False, True]),
        active=np.zeros(5, dtype=int),
        collisions=0,
        finished=True,
    )
    task = SimpleNamespace(law=SimpleNamespace(subgoals=np.zeros((6, 2))))
    leaps = driving.rows_of_leaps(run)
    assert leaps == [2]
    shown = list(driving.rows_shown(run, leaps, 60))
    assert len(shown) == 60
    told = list(dict.fromkeys(driving.caption_of(run, task, *each, leaps) for each in shown))
    first, carried, lost, last = told
    assert first == "the robot performs the task: to subgoal 1 of 6" and last == "finished, nothing touched"
    assert carried.startswith("kidnapped") and lost.startswith("lost")
    heights = [driving.pose_at(run, *each)[1] for each in shown]
    assert max(heights) == driving.HELD_UP and heights[0] == heights[-1] == 0
    assert {row for (row, carried), height in zip(shown, heights, strict=True) if height} == {2}


def test_a_user_out_of_sight_is_told():
    """Before anybody moves, in sight, and behind a can."""
    user = SimpleNamespace(t=np.array([0.0, 5.0]))
    told = [showing.caption_of(user, 5.1), showing.caption_of(user, 6.0), showing.caption_of(None, 0.1)]
    assert "shows" in told[0] and "out of sight" in told[1] and "nobody" in told[2]


def test_a_frame_has_its_caption_above():
    """Words at the top, and the pictures as they are below."""
    (frame, half), black = sizes(960), Image.new("RGB", sizes(960)[1])
    picture = np.asarray(captioned(960, "kidnapped", "1.0 s", black, black))
    assert picture.shape[:2] == frame[::-1]
    above, below = picture[: frame[1] - half[1]], picture[frame[1] - half[1] :]
    assert above.max() == 255 and above.min() < 100 and below.max() == 0


# ---- what is refused


def test_an_unknown_film_is_refused(no_work, capsys):
    """With the names of those that there are."""
    with pytest.raises(SystemExit):
        films.main(["shwon"])
    assert "shwon" in (told := capsys.readouterr().err) and all(name in told for name in films.FILMS)
    with pytest.raises(ValueError, match="'moved_cans'.*'shwon'"):
        films.film("shwon")
    with pytest.raises(ValueError, match="'moved_cans'.*'shwon'"):
        films.show("shwon")


@pytest.mark.parametrize(
    ("asked", "rule"),
    [
        (["--width", "161"], "width must be even, got 161"),
        (["--width", "20"], "width .*160"),
        (["--seconds", "0"], "seconds .*0.5"),
        (["--seconds", "nan"], "seconds"),
    ],
)
def test_a_size_that_is_none_is_refused(asked, rule, no_work, av, capsys, tmp_path):
    """Before the work, with the rule."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    with pytest.raises(SystemExit):
        films.main(["merging", "--folder", str(tmp_path), *asked])
    assert re.search(rule, capsys.readouterr().err)


@pytest.mark.parametrize("where", ["films", "films/merging.mp4"])
def test_a_folder_that_cannot_be_written_is_refused(where, no_work, av, capsys, tmp_path):
    """A file in its place, or something else by the name of a film: told before the work."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    taken = tmp_path / where
    taken.parent.mkdir(exist_ok=True)
    taken.write_text("mine")
    with pytest.raises(SystemExit):
        films.main(["merging", "--folder", str(tmp_path / "films")])
    assert "cannot be written to" in capsys.readouterr().err and taken.read_text() == "mine"


def test_a_missing_encoder_is_told(no_work, monkeypatch, tmp_path):
    """With the line that installs it."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(ImportError, match=re.escape('pip install "dollop[films]"')):
        films.film("merging", tmp_path)


# ---- in a notebook


def test_a_film_is_shown_with_its_words():
    """The video is in the page itself, loops silently, and says in words what it shows."""
    page = films.show("kidnapped", FOLDER)._repr_html_()
    for word in ("controls", "loop", "muted", "playsinline", 'aria-label="', "question mark", "<figcaption>"):
        assert word in page
    found = re.search(r'src="data:video/mp4;base64,([^"]+)"', page)
    assert base64.b64decode(found[1]) == (FOLDER / "kidnapped.mp4").read_bytes()
    assert '<img src="data:image/gif' in films.show("dollop", FOLDER).data


def test_a_missing_film_says_how_to_make_it(tmp_path):
    """No exception in the notebook: a sentence."""
    assert "make films" in films.show("slalom", tmp_path).data


def test_every_film_is_told_in_words():
    """Title and alternative text of each say something, and each something else."""
    assert len({each.title for each in films.FILMS.values()}) == len(films.FILMS)
    assert all(len(each.words) > 150 for each in films.FILMS.values())
