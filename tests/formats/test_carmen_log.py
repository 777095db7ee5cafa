"""CARMEN logs and odometry."""

import gzip
import os
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dollop.formats import carmen_log
from dollop.formats.files import FormatError
from dollop.laser import LaserLog

external = pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")


def flaser(ranges, pose=(1, 2, 0.5), t=0.0):
    """One FLASER line; the odometry pose is another than the laser's."""
    numbers = " ".join(str(value) for value in (*ranges, *pose, 9, 9, 9))
    return f"FLASER {len(ranges)} {numbers} {t} host {t}"


def read_log(path, **options):
    """Read a log of FLASER lines with few beams, which spread over half a turn."""
    return carmen_log.read_log(path, fov=np.pi, **options)


def flasers(count, ranges=(1.0, 2.0, 3.0)):
    """`count` good FLASER lines, a tenth of a second apart."""
    return [flaser(ranges, t=i / 10) for i in range(count)]


def write(path, lines):
    """Write lines and return the path."""
    path.write_text("\n".join(lines) + "\n")
    return path


def random_log(seed=0, scans=30, beams=19, max_range=8.191):
    """A log of noise, a tenth of it without return."""
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.1, 8.1, (scans, beams))
    ranges[rng.random(ranges.shape) < 0.1] = np.inf
    poses = rng.normal(size=(scans, 3))
    t, angles = 100 + np.arange(scans) / 10, np.linspace(-1.5, 1.5, beams)
    return LaserLog(t, ranges, angles, poses, max_range)


def assert_equal_to_precision(read, log):
    """The same log, to 1 mm in range; poses and times to the last digit."""
    np.testing.assert_array_equal(np.isinf(read.ranges), np.isinf(log.ranges))
    finite = np.isfinite(log.ranges)
    assert np.abs(read.ranges[finite] - log.ranges[finite]).max(initial=0) <= 0.001 + 1e-9
    np.testing.assert_array_equal(read.t, log.t)
    np.testing.assert_array_equal(read.poses, log.poses)
    np.testing.assert_allclose(read.angles, log.angles, atol=1e-12)
    assert read.max_range == log.max_range


def test_flaser_is_read_as_carmen_means_it(tmp_path):
    """Ranges, the laser's pose (not the odometry's), time, and beams from -90 degrees.

    Comments are passed over.
    """
    ranges = [1.5] * 180
    others = ["# FLASER is a comment here", "PARAM x 1 nohost 0", "NEFF 3", ""]
    lines = [*others, flaser(ranges, (1, 2, 0.5), 7.25), *others]
    log = carmen_log.read_log(write(tmp_path / "a.log", lines))
    assert log.ranges.shape == (1, 180) and (log.ranges == 1.5).all()
    assert log.poses.tolist() == [[1, 2, 0.5]] and log.t.tolist() == [7.25]
    np.testing.assert_allclose(np.rad2deg(log.angles), np.arange(-90, 90))


def test_robotlaser_is_read_with_its_own_geometry(tmp_path):
    """Start, resolution, maximum range and laser pose come from the message.

    Remissions are passed over.
    """
    readings, ending = "5 1 2 5.6 3 0 2 7 8", "1 2 3 4 5 6 0 0 0 0 0 12.5 host 0.1"
    line = f"ROBOTLASER1 2 -0.5 1.0 0.25 5.6 0.01 0 {readings} {ending}"
    log = carmen_log.read_log(write(tmp_path / "a.log", [line]))
    assert log.ranges.tolist() == [[1, 2, np.inf, 3, np.inf]]
    assert log.angles.tolist() == [-0.5, -0.25, 0, 0.25, 0.5]
    assert log.poses.tolist() == [[1, 2, 3]] and log.t.tolist() == [12.5] and log.max_range == 5.6


@pytest.mark.parametrize(
    ("count", "first", "last"),
    [
        *((180, -90, 89), (181, -90, 90), (360, -90, 89.5), (361, -90, 90)),
        *((401, -50, 50), (91, -90, 90), (1, -90, -90)),
    ],
)
def test_flaser_angles(count, first, last):
    """The number of readings decides the spacing, as in CARMEN's reader."""
    angles = np.rad2deg(carmen_log._flaser_beams(count).angles)
    assert len(angles) == count
    np.testing.assert_allclose(angles[[0, -1]], [first, last], atol=1e-9)


@pytest.mark.parametrize(
    ("code", "max_range"),
    [(8.191, 8.183), (8.183, 8.183), (32.767, 32.759), (51.15, 51.14), (81.83, 80.0), (81.91, 80)],
)
def test_error_codes_are_no_returns(tmp_path, code, max_range):
    """A reading at the laser's full scale means that nothing came back.

    So does a reading of zero.
    """
    log = read_log(write(tmp_path / "a.log", [flaser([1.0, code, 2.0, 0.0])]))
    assert log.ranges.tolist() == [[1.0, np.inf, 2.0, np.inf]]
    assert log.max_range == max_range


def test_a_code_of_millimetres_is_a_distance_among_centimetres(tmp_path):
    """8.19 m is a distance in a log whose readings go up to 81.91 m."""
    log = read_log(write(tmp_path / "a.log", [flaser([8.19, 81.91])]))
    assert log.ranges.tolist() == [[8.19, np.inf]]


def test_unknown_full_scale_is_suspected(tmp_path):
    """Many readings exactly at the largest one, always in the same beam, give a warning and a note.

    They say how to read them as no return.
    """
    path = write(tmp_path / "a.log", [flaser([1.0, 2.0, 30.0, 4.0], t=i) for i in range(300)])
    with pytest.warns(UserWarning, match="25.0% of the readings pile up at 30 m"):
        log = read_log(path)
    assert [(note.kind, note.doubt) for note in log.notes] == [("sensor", True)]
    assert (log.ranges[:, 2] == 30.0).all()
    log = read_log(path, max_range=30.0)
    assert np.isinf(log.ranges[:, 2]).all() and not log.notes


def test_unknown_full_scale_is_found(tmp_path, recwarn):
    """Many readings exactly at the largest one, from everywhere, are no return; a note says so."""
    ranges = np.random.default_rng(0).uniform(1.0, 4.0, (300, 4)).round(3)
    ranges[np.arange(300), np.arange(300) % 4] = 50.0
    rows = [flaser(row, t=i) for i, row in enumerate(ranges)]
    log = read_log(write(tmp_path / "a.log", rows))
    assert np.isinf(log.ranges).sum() == 300 and log.max_range == 50.0
    assert [(note.kind, note.doubt) for note in log.notes] == [("sensor", False)]
    assert not len(recwarn)


def test_a_guessed_field_of_view_is_told(tmp_path):
    """A number of beams that CARMEN does not know is a guess; told the angle, nothing is guessed."""
    path = write(tmp_path / "a.log", [flaser(np.linspace(1, 5, 271), t=i / 10) for i in range(30)])
    text = "271 beams are taken to spread over 180 degrees, which the file does not state; .*fov="
    with pytest.warns(UserWarning, match=text):
        log = carmen_log.read_log(path)
    assert [(note.kind, note.doubt) for note in log.notes] == [("sensor", True)] and "fov=" in log.notes[0].text
    log = carmen_log.read_log(path, fov=np.radians(270))
    assert not log.notes
    np.testing.assert_allclose(np.degrees(log.angles), np.arange(-135, 136))


def test_one_beam_looks_ahead_whatever_the_field_of_view(tmp_path):
    """The middle of the field is where a single beam is."""
    log = carmen_log.read_log(write(tmp_path / "a.log", [flaser([1.0])]), fov=1.0)
    assert log.angles.tolist() == [0.0]


@pytest.mark.parametrize(("count", "doubt"), [(180, False), (181, False), (360, True), (361, True)])
def test_a_known_number_of_beams_is_doubted_where_its_ends_meet(tmp_path, count, doubt):
    """360 beams half a degree apart, or one: those of a full turn see the same with the last as with the first."""
    turn = np.arange(count) * 2 * np.pi / count
    for ranges, told in ((3 + np.sin(turn), doubt), (3 + np.sin(turn / 2 + np.pi / 4), False)):
        path = write(tmp_path / "a.log", [flaser(ranges.round(3), t=i / 10) for i in range(30)])
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            notes = carmen_log.read_log(path).notes
        assert [note.doubt for note in notes] == [True] * told and len(caught) == told
        assert all("the first and the last see the same" in note.text for note in notes)


@pytest.mark.parametrize("fov", [0.0, -1.0, 7.0, np.nan, np.inf, "180"])
def test_fov_out_of_range_is_named(tmp_path, fov):
    """The error names the value and the rule."""
    with pytest.raises(ValueError, match="fov must be .*got"):
        carmen_log.read_log(write(tmp_path / "a.log", flasers(3)), fov=fov)


def test_fov_of_a_message_that_states_it_is_refused(tmp_path):
    """A ROBOTLASER1 message says where its beams are: to say it again is an error."""
    carmen_log.write_log(tmp_path / "a.log", random_log())
    with pytest.raises(ValueError, match=r"a\.log: ROBOTLASER1 messages state their field of view, got fov=3"):
        carmen_log.read_log(tmp_path / "a.log", fov=3.0)


def test_robotlaser_is_preferred(tmp_path):
    """Where a log holds the same scans twice, the message that states its geometry is taken."""
    carmen_log.write_log(tmp_path / "a.log", random_log())
    with open(tmp_path / "a.log", "a") as stream:
        stream.write("\n".join(flasers(30)))
    assert carmen_log.read_log(tmp_path / "a.log").ranges.shape == (30, 19)


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    scans=st.integers(1, 4),
    beams=st.integers(1, 12),
    start=st.floats(-np.pi, 0),
    fov=st.floats(0.1, 2 * np.pi),
    max_range=st.floats(0.01, 100),
    suffix=st.sampled_from([".log", ".log.gz"]),
)
def test_round_trip(seed, scans, beams, start, fov, max_range, suffix):
    """What is written is read back to the format's precision.

    For any geometry, maximum range and share of inf.
    """
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0, max_range, (scans, beams))
    ranges[rng.random(ranges.shape) < 0.3] = np.inf
    t = np.cumsum(rng.uniform(0.01, 1, scans)) + rng.choice([0, 1.4e9])
    angles = start + np.linspace(0, fov, beams)
    log = LaserLog(t, ranges, angles, rng.normal(0, 100, (scans, 3)), max_range)
    with tempfile.TemporaryDirectory() as folder:
        carmen_log.write_log(Path(folder) / f"a{suffix}", log)
        assert_equal_to_precision(carmen_log.read_log(Path(folder) / f"a{suffix}"), log)


def test_time_stamps_stay_those_of_the_log(tmp_path):
    """CARMEN's microseconds are written as CARMEN writes them, ROS's nanoseconds as far as a float holds them."""
    log = replace(random_log(scans=3), t=[976052857.267389, 1700000000.0, 1700000000.123456789])
    carmen_log.write_log(tmp_path / "a.log", log)
    written = [line.split()[-3] for line in (tmp_path / "a.log").read_text().splitlines()[2:]]
    assert written == ["976052857.267389", "1700000000.000000", "1700000000.1234567"]
    with pytest.warns(UserWarning, match="the clock jumps"):
        np.testing.assert_array_equal(carmen_log.read_log(tmp_path / "a.log").t, log.t)


def test_the_same_log_gives_the_same_bytes(tmp_path):
    """A packed log holds neither its name nor the time of writing."""
    for name in ("a.log.gz", "b.log.gz"):
        carmen_log.write_log(tmp_path / name, random_log())
    assert (tmp_path / "a.log.gz").read_bytes() == (tmp_path / "b.log.gz").read_bytes()


def test_uneven_beams_cannot_be_written(tmp_path):
    """CARMEN knows one angular resolution, so other beams are refused and no file appears."""
    log = LaserLog([0.0], [[1.0, 1.0, 1.0]], [0.0, 0.1, 0.3], [[0, 0, 0]], 8.0)
    with pytest.raises(ValueError, match="evenly spaced"):
        carmen_log.write_log(tmp_path / "a.log", log)
    assert not list(tmp_path.iterdir())


GOOD_LINE = flaser((1.0, 2.0, 3.0), t=99.0)
BAD_LINES = {
    "4 fields in the line, expected 13 or 14": "FLASER 3 1.0 2.0",
    "must be at least 1, got 0": "FLASER",
    "could not convert string to float: b.host": GOOD_LINE.replace("1.0 ", "", 1),
    "must be finite, .*, got nan": GOOD_LINE.replace("2.0", "nan", 1),
    "must be finite, .*, got inf": GOOD_LINE.replace("2.0", "inf", 1),
    "a range must be finite, not negative .*, got -2": GOOD_LINE.replace("2.0", "-2.0", 1),
    "could not convert string to float: b'two'": GOOD_LINE.replace("2.0", "two", 1),
    "invalid literal for int.. with base 10: b'3.5'": GOOD_LINE.replace("FLASER 3", "FLASER 3.5"),
    "must be at least 1, got -3": GOOD_LINE.replace("FLASER 3", "FLASER -3"),
    "where most scans have 3 beams": flaser((1.0, 2.0, 3.0, 4.0), t=99.0),
}


@pytest.mark.parametrize("message", BAD_LINES)
def test_one_bad_line_in_a_long_log(tmp_path, message):
    """One broken line among many good ones is left out, with one warning that names it."""
    lines = flasers(50)
    lines.insert(10, BAD_LINES[message])
    path = write(tmp_path / "a.log", lines)
    text = f"left out 1 broken of 51 scans, the first on line 11: .*{message}"
    with pytest.warns(UserWarning, match=text) as record:
        log = read_log(path)
    assert len(log) == 50 and len(record) == 1


@pytest.mark.parametrize("message", BAD_LINES)
def test_one_bad_line_in_a_short_log(tmp_path, message):
    """The same line in a log of three scans is an error with file and line."""
    lines = flasers(3)
    lines.insert(1, BAD_LINES[message])
    with pytest.raises(FormatError, match=r"a\.log, line 2: "):
        read_log(write(tmp_path / "a.log", lines))


def test_a_byte_order_mark_costs_no_scan(tmp_path):
    """The first message counts also where an editor put a mark before it."""
    (tmp_path / "a.log").write_text("\n".join(flasers(30)), encoding="utf-8-sig")
    assert len(read_log(tmp_path / "a.log")) == 30


@pytest.mark.parametrize("max_range", [0, -1.0, np.nan, np.inf])
def test_max_range_out_of_range_is_named(tmp_path, max_range):
    """The error names the value and the rule."""
    with pytest.raises(ValueError, match=f"max_range must be positive and finite, got {max_range}"):
        read_log(write(tmp_path / "a.log", flasers(3)), max_range=max_range)


def test_cut_off_log_loses_its_last_line(tmp_path):
    """A log cut off in the middle of a line is read up to there, with a warning."""
    text = "\n".join(flasers(50))
    (tmp_path / "a.log").write_text(text[:-25])
    with pytest.warns(UserWarning, match="left out 1 broken of 50 scans, the first on line 50"):
        assert len(read_log(tmp_path / "a.log")) == 49


def test_cut_off_time_is_not_taken_for_a_time(tmp_path):
    """A line that ends in the middle of its time is broken.

    Nothing shows that the number is whole.
    """
    lines = flasers(50)
    lines[-1] = lines[-1][: lines[-1].index(" host")]
    with pytest.warns(UserWarning, match="left out 1 broken of 50"):
        assert read_log(write(tmp_path / "a.log", lines)).t[-1] == 4.8


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (b"# CARMEN Logfile\n", "no FLASER or ROBOTLASER1 message"),
        (b"ODOM 0 0 0 0 0 0 1 host 1\n", "no FLASER or ROBOTLASER1 message"),
        (b"\x7fELF\0\0\1\2" * 50, "binary"),
        (bytes(range(128, 256)) * 50, "no FLASER"),
        (b"FLASER 3 1 2\n", "4 fields in the line, expected 13 or 14 .1 of 1 scans"),
        (gzip.compress(GOOD_LINE.encode() * 50, mtime=0)[:-20], "gzip data cut short"),
    ],
)
def test_what_is_no_log(tmp_path, content, message):
    """Empty, binary, truncated and other files give a FormatError that says what is wrong."""
    (tmp_path / "a.log").write_bytes(content)
    with pytest.raises(FormatError, match=message):
        read_log(tmp_path / "a.log")


def test_standing_clock_is_replaced_with_a_warning(tmp_path):
    """A log whose clock is all zero keeps its scans, at the nominal rate, and says so."""
    path = write(tmp_path / "a.log", [flaser((1.0, 2.0), t=0) for _ in range(30)])
    with pytest.warns(UserWarning, match="stands still or runs backwards .29 of 30.*10 Hz"):
        log = read_log(path)
    np.testing.assert_allclose(log.t, np.arange(30) / 10)


def test_a_step_back_in_time_is_left_out(tmp_path):
    """One scan stamped before its predecessor goes, with a warning.

    The poses keep to their scans.
    """
    lines = flasers(50)
    lines[20] = flaser((1.0, 2.0, 3.0), pose=(5, 5, 5), t=1.0)
    with pytest.warns(UserWarning, match="left out 1 of 50 scans, which the clock puts out"):
        log = read_log(write(tmp_path / "a.log", lines))
    assert len(log) == 49 and 5 not in log.poses


EDITS = st.tuples(st.integers(0, 10**6), st.integers(0, 3), st.binary(max_size=6))


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    kind=st.sampled_from(["flaser", "robotlaser", "odometry"]),
    edits=st.lists(EDITS, min_size=1, max_size=4),
    zipped=st.booleans(),
)
def test_damaged_files_never_fail_in_the_depth(tmp_path, kind, edits, zipped):
    """Whatever is overwritten, inserted, cut out or cut off.

    A log or a FormatError, and never another exception.
    """
    path = tmp_path / "a.log"
    if kind == "robotlaser":
        path.unlink(missing_ok=True)  # damaged by the example before, it would not be replaced
        carmen_log.write_log(path, random_log(scans=25, beams=3))
    else:
        write(path, [*flasers(25), *(f"ODOM {i} 0 0 0 0 0 {i} host {i}" for i in range(25))])
    content = gzip.compress(path.read_bytes()) if zipped else path.read_bytes()
    for place, action, piece in edits:
        place %= len(content) + 1
        end = {0: place + len(piece), 1: place, 2: place + 20, 3: len(content)}[action]
        content = content[:place] + piece + content[end:]
    path.write_bytes(content)
    read = carmen_log.read_odometry if kind == "odometry" else carmen_log.read_log
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            assert len(read(path)) > 0
        except FormatError as error:
            assert "a.log" in str(error)


def test_odometry(tmp_path):
    """ODOM gives time, pose with wrapped heading, and velocity.

    A message out of order is left out with a warning.
    """
    lines = [f"ODOM {i} {2 * i} {0.5 + 2 * np.pi} 0.3 0.1 0 {i / 10} host 0" for i in range(30)]
    lines.insert(5, "ODOM 7 7 7 0 0 0 0.0 host 0")
    with pytest.warns(UserWarning, match="left out 1 of 31 ODOM messages"):
        odometry = carmen_log.read_odometry(write(tmp_path / "a.log", lines))
    i = np.arange(30)
    np.testing.assert_allclose(odometry.t, i / 10)
    np.testing.assert_allclose(odometry.poses, np.stack([i, 2 * i, 0 * i + 0.5], axis=1))
    np.testing.assert_allclose(odometry.velocities, [[0.3, 0.1]] * 30)


def test_odometry_without_a_clock_is_refused(tmp_path):
    """Odometry whose clock stands still cannot be set against the scans, so it is an error."""
    with pytest.raises(FormatError, match="clock is useless: 29 of 30"):
        carmen_log.read_odometry(write(tmp_path / "a.log", ["ODOM 0 0 0 0 0 0 0 host 0"] * 30))
    with pytest.raises(FormatError, match="no readable ODOM"):
        carmen_log.read_odometry(write(tmp_path / "a.log", flasers(3)))


@external
@pytest.mark.parametrize(
    ("name", "odometry"), [("intel", 10391), ("edmonton", 5858), ("csail", None), ("orebro", None)]
)
def test_real_odometry(name, odometry):
    """Two of the recorded logs hold odometry with a usable clock; in the others it is refused."""
    path = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / f"carmen_logs/{name}-corrected.log.gz"
    if odometry is None:
        with pytest.raises(FormatError, match="clock is useless"):
            carmen_log.read_odometry(path)
    else:
        with pytest.warns(UserWarning, match="ODOM messages"):
            assert len(carmen_log.read_odometry(path)) == odometry


@pytest.mark.parametrize(("kind", "back"), [(0, False), (1, False), (2, True), (99, True)])
def test_error_codes_are_those_of_a_sick(tmp_path, kind, back):
    """Just below the stated range is an error code of a SICK.

    To any other laser it is a distance.
    """
    ending = "0 1 2 3 4 5 6 0 0 0 0 0 12.5 host 0.1"
    line = f"ROBOTLASER1 {kind} -0.5 1.0 0.5 8.191 0.01 0 3 1 8.185 8.191 {ending}"
    log = carmen_log.read_log(write(tmp_path / "a.log", [line]))
    assert np.isfinite(log.ranges).tolist() == [[True, back, False]]


def test_odometry_needs_a_clock_for_half_of_it(tmp_path):
    """With 15 of 30 messages in order the others are left out.

    With 14 of 30 the clock is useless.
    """
    for ordered in (15, 14):
        times = [*range(1, ordered + 1), *[0] * (30 - ordered)]
        path = write(tmp_path / "a.log", [f"ODOM 0 0 0 0 0 0 {t} host 0" for t in times])
        if ordered == 15:
            with pytest.warns(UserWarning, match="left out 15 of 30"):
                assert len(carmen_log.read_odometry(path)) == 15
        else:
            with pytest.raises(FormatError, match="clock is useless: 16 of 30"):
                carmen_log.read_odometry(path)


# ---- numbers and lasers that cannot be


def robotlaser(start=-1.0, step=0.5, limit=8.0, ranges=(1.0, 2.0, 3.0), t=0.0):
    """One ROBOTLASER1 line."""
    numbers = " ".join(map(str, ranges))
    return (
        f"ROBOTLASER1 0 {start} 1.0 {step} {limit} 0.01 0 {len(ranges)} {numbers} 0 1 2 3 1 2 3 0 0 0 0 0 {t} host {t}"
    )


GOOD = flaser((1.0, 2.0, 3.0), t=99.0)
NO_LASER = {
    "could not convert string to float: b'1_0'": GOOD.replace("1.0", "1_0", 1),
    "invalid literal for int.. with base 10: b'0_3'": GOOD.replace("R 3", "R 0_3"),
    "a number of readings must have at most nine digits, got b'9999": GOOD.replace("R 3", "R " + "9" * 5000),
    "could not convert string to float: b'0x1p3'": GOOD.replace("1.0", "0x1p3", 1),
    r"could not convert string to float: b'.xd9.xa1'": GOOD.replace("1.0", "\u0661", 1),
    r"must be finite, and within 1e\+10, got 1e\+300": flaser((1.0, 2.0, 3.0), t="1e300"),
    r"a range must be finite, not negative and within 1e\+09 m, got 2e\+09": GOOD.replace("2.0", "2e9", 1),
    r"a pose must be within 1e\+09 m, got .5000000000.0, 0.0, 0.0": flaser((1.0, 2.0, 3.0), pose=(5e9, 0, 0)),
    "a scan must have 1 to 36000 beams, got 36001": flaser([1.0] * 36_001),
    "beams must spread over at most a full turn, got 3 beams from -1 rad": robotlaser(step=9),
    "beams must spread over at most a full turn, got 3 beams from 99 rad": robotlaser(start=99),
    "an angular resolution must be positive and finite, got 0.0": robotlaser(step=0),
}


@pytest.mark.parametrize("message", NO_LASER)
def test_what_no_laser_says_is_refused(tmp_path, message):
    """Numbers that only Python reads, and beams, ranges and places that cannot be, with the line and the rule."""
    with pytest.raises(FormatError, match=rf"a\.log, line 1: .*{message}") as error:
        read_log(write(tmp_path / "a.log", [NO_LASER[message]]))
    assert len(str(error.value)) <= 300


def test_a_host_may_have_an_underscore(tmp_path):
    """It is no number."""
    assert len(read_log(write(tmp_path / "a.log", [GOOD.replace("host", "my_host")]))) == 1


def test_a_full_turn_is_none_too_many(tmp_path):
    """Beams all round, first and last in one direction, are a laser's."""
    log = carmen_log.read_log(write(tmp_path / "a.log", [robotlaser(-np.pi, np.pi)]))
    np.testing.assert_allclose(log.angles, [-np.pi, 0, np.pi])


@pytest.mark.parametrize("read", [read_log, carmen_log.read_odometry])
def test_a_million_broken_lines_are_not_gone_through(tmp_path, read):
    """When more are broken than could be forgiven, however many follow, the log is refused."""
    name = "FLASER" if read is read_log else "ODOM"
    (tmp_path / "a.log").write_text(f"{name}\n" * 300_000)
    with pytest.raises(FormatError, match="20001 of 20001 scans are broken"):
        read(tmp_path / "a.log")


def test_more_readings_than_are_read(tmp_path, monkeypatch):
    """Readings are counted over all scans."""
    monkeypatch.setattr(carmen_log, "MAX_READINGS", 100)
    with pytest.raises(FormatError, match="a.log, line 8: more than 100 readings, the most that is read"):
        read_log(write(tmp_path / "a.log", flasers(9)))


def test_odometry_tells_what_is_wrong(tmp_path):
    """Where no message can be read, the first one is told."""
    with pytest.raises(FormatError, match="line 1: could not convert string to float: b'0_1' .1 of 1 scans are broken"):
        carmen_log.read_odometry(write(tmp_path / "a.log", ["ODOM 1 2 3 0_1 0 0 1 host 1"]))


def test_scans_that_are_alike_may_be_packed(tmp_path):
    """A laser without noise packs to less than a hundredth, and is read back; lines that are passed over may not."""
    count, angles = 5000, np.radians(np.arange(-90.0, 91.0))
    log = LaserLog(np.arange(float(count)), np.full((count, 181), 5.0), angles, np.zeros((count, 3)), 80.0)
    carmen_log.write_log(tmp_path / "a.log.gz", log)
    np.testing.assert_array_equal(carmen_log.read_log(tmp_path / "a.log.gz").ranges, log.ranges)
    (tmp_path / "b.log.gz").write_bytes(gzip.compress((b"a" * 99_999 + b"\n") * 100))
    with pytest.raises(FormatError, match="lines that are passed over: 100 times the size of the file is the most"):
        carmen_log.read_log(tmp_path / "b.log.gz")
