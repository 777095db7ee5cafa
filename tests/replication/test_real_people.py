"""Real people beside simulated ones: known walks give known numbers, and what is published is what is measured."""

import json
import os
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from places import ROOT

from dollop.formats.files import FormatError
from dollop.lab.people import read_walks
from dollop.laser import LaserLog
from dollop.replication import people
from dollop.replication.claims.observing import causal_states
from dollop.tracking import Motion

external = pytest.mark.skipif(people.DATA not in os.environ, reason=f"{people.DATA} names no folder")
SPEED = 1.4


def crossing(path, count=4, seconds=9.0):
    """People who walk straight on at 1.4 m/s, as the data set of walks has them."""
    frame = np.arange(int(seconds * 29.97) + 1)
    tables = []
    for k in range(count):
        columns = {"id": k, "frame": frame, "label": "ped", "x_est": SPEED * frame / 29.97, "y_est": float(k)}
        tables.append(pd.DataFrame(columns))
    path.mkdir()
    pd.concat(tables).to_csv(path / "a_traj_ped_filtered.csv.gz", index=False)
    return [people.even_walk(walk) for walk in read_walks(path)]


def standing_log(places, t, noise=0.0, radius=0.2):
    """A disc before a laser at the origin in an empty place, 20 m wide."""
    angles = np.radians(np.arange(-90.0, 90.5, 0.5))
    ways = np.column_stack([np.cos(angles), np.sin(angles)])
    along = places @ ways.T
    deep = radius**2 - (places**2).sum(axis=1)[:, None] + along**2
    ranges = np.where((deep > 0) & (along > 0), along - np.sqrt(np.maximum(deep, 0)), 10.0)
    ranges += np.random.default_rng(0).normal(0, noise, ranges.shape)
    return LaserLog(t, ranges, angles, np.zeros((len(t), 3)), 20.0)


def test_without_a_folder_it_is_said_which_one_is_missing(monkeypatch, tmp_path):
    """No recording is made up: the variable must name a folder, which must hold what is measured."""
    monkeypatch.delenv(people.DATA, raising=False)
    with pytest.raises(ValueError, match=f"{people.DATA} to name a folder .* got None"):
        people.command(SimpleNamespace(folder=tmp_path / "out"))
    assert not (tmp_path / "out").exists()
    monkeypatch.setenv(people.DATA, str(tmp_path / "gone"))
    with pytest.raises(ValueError, match="gone"):
        people.folder_of_recordings()
    pytest.importorskip("rosbags")
    pytest.importorskip("pybullet")
    with pytest.raises(FormatError, match="walks"):
        people.numbers(tmp_path)


def test_who_walks_straight_on_is_predicted_and_who_is_left_standing_is_missed(tmp_path):
    """At 1.4 m/s the error of standing still is that of the way, on average over the time hidden."""
    walks = crossing(tmp_path / "walks")
    found = people.hidden_people(walks)
    for seconds in people.HIDDEN:
        n = round(seconds / people.PERIOD)
        errors, missed = found["velocity", n]
        assert errors == pytest.approx([0.0] * 4, abs=0.01) and not missed.any()
        errors, missed = found["standing", n]
        assert errors == pytest.approx([SPEED * people.PERIOD * (n + 1) / 2] * 4, abs=0.01)
        assert missed.all() == (SPEED * seconds > people.MISSED)
    errors, missed = people.particle_errors(walks, walks, Motion(2, 0.03), 10)
    assert errors.max() < 0.05 and not missed.any()


def test_numbers_of_hidden_people_are_told_with_who_and_how_many(tmp_path):
    """Noise and source stand with each number; who walks for too short a time gives none."""
    walks = crossing(tmp_path / "walks", seconds=5.0)
    rows = people.numbers_hidden(walks, people.NOISE, people="real", source="made up")
    assert {(row.people, row.source, row.noise_mm) for row in rows} == {("real", "made up", 28.0)}
    assert {row.n for row in rows if row.hidden_s < 2.5} == {4}
    assert {(row.n, row.mean, row.low) for row in rows if row.hidden_s > 3.0} == {(0, None, None)}


@pytest.mark.parametrize("order", [2, 3])
def test_several_people_are_filtered_as_one_is(order):
    """Each as if alone, however long the others walk."""
    rng = np.random.default_rng(order)
    walks = [rng.normal(size=(n, 2)).cumsum(axis=0) for n in (7, 12)]
    means, _ = people.states_of(walks, Motion(order, 0.3))
    for k, walk in enumerate(walks):
        alone = causal_states(people.PERIOD * np.arange(len(walk)), walk, Motion(order, 0.3))
        np.testing.assert_allclose(means[: len(walk), k], alone, atol=1e-9)


def test_predictions_go_on_step_by_step():
    """So many steps at once are as many single ones."""
    mean, motion = np.random.default_rng(0).normal(size=(3, 2)), Motion(3)
    steps, state = [], mean
    for _ in range(5):
        state = motion.transition(people.PERIOD)[0] @ state
        steps.append(state[0])
    np.testing.assert_allclose(people.predictions(mean, 5, motion), steps, atol=1e-12)


@pytest.mark.parametrize("rate", [7.5, 10.0])
def test_noise_about_a_smooth_way_is_found_without_the_truth(rate):
    """On a curved walk at any rate of scans, 30 mm within a tenth; without noise there is none."""
    t = np.arange(0.0, 80.0, 1 / rate)
    way = np.column_stack([3 * np.cos(t / 3), 3 * np.sin(t / 3)])
    noisy = way + np.random.default_rng(1).normal(0, 0.03, way.shape)
    noisy[::9] = np.nan
    assert people.local_noise(people.Seen(t, noisy)) == pytest.approx(0.03, rel=0.1)
    assert people.local_noise(people.Seen(t, way)) < 0.002


def test_a_gap_is_compared_with_what_was_seen_in_it():
    """Straight on there is no error; half a circle through a gap is off, and a gap without anybody is none."""
    t = np.arange(0.0, 10.0, 0.1)
    straight = people.Seen(t, np.column_stack([t, 0 * t]))
    round_ = people.Seen(t, np.column_stack([np.cos(t), np.sin(t)]))
    assert people.gap_errors(straight, 5.0) < 0.01
    assert people.gap_errors(round_, 1.0) < 0.03 < people.gap_errors(round_, 5.0)
    blind = np.where((np.abs(t - 5) < 1)[:, None], np.nan, straight.centroids)
    assert np.isnan(people.gap_errors(people.Seen(t, blind), 1.0))


def test_centroids_lie_on_the_near_side_of_who_is_there():
    """Those of a disc are before its middle by up to its radius; those of what stands are none."""
    t = np.arange(0.0, 12.0, 0.1)
    places = np.column_stack([np.full_like(t, 3.0), np.linspace(-4.0, 4.0, len(t))])
    log = standing_log(places, t)
    for rows in (None, np.arange(len(t))):
        seen = people.seen_of(log, t, places, rows)
        before = np.linalg.norm(places, axis=1) - np.linalg.norm(seen.centroids, axis=1)
        assert before.min() > 0.1 and before.max() < 0.2
    assert len(people.stretches(seen)) == 1
    still = people.seen_of(standing_log(np.full((120, 2), 2.0), t), t, np.full((120, 2), 2.0))
    assert np.isnan(still.centroids).all() and not people.stretches(people.Seen(t[:30], still.centroids[:30]))


def test_a_marked_person_is_read_from_a_bag(tmp_path):
    """A zipped bag of scans and marked places, in the laser's frame, gives the centroids round those."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("geometry_msgs/Pose pose\nuint32 id", "leg_tracker/msg/Person"))
    types, scan, person = store.types, "sensor_msgs/msg/LaserScan", "leg_tracker/msg/Person"
    t = 100 + np.arange(0.0, 3.0, 0.1)
    places = np.column_stack([np.full_like(t, 3.0), np.linspace(-1.0, 1.0, len(t))])
    log, none = standing_log(places, t), np.array([], np.float32)
    with Writer(tmp_path / "a.bag") as bag:
        first = bag.add_connection("/scan_base2", scan, typestore=store)
        second = bag.add_connection("/ground_truth_people_tracks", person, typestore=store)
        for i, (when, (x, y)) in enumerate(zip(t, places, strict=True)):
            stamp = types["builtin_interfaces/msg/Time"](sec=int(when), nanosec=int(when % 1 * 1e9))
            header = types["std_msgs/msg/Header"](seq=i, stamp=stamp, frame_id="laser")
            bearings = log.angles[0], log.angles[-1], np.radians(0.5)
            ranges = log.ranges[i].astype(np.float32)
            message = types[scan](header, *bearings, 0.0, 0.1, 0.1, 20.0, ranges, none)
            at = round(1e9 * when)
            bag.write(first, at, bytes(store.serialize_ros1(message, scan)))
            point = types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
            turn = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
            marked = types[person](types["geometry_msgs/msg/Pose"](point, turn), 2)
            bag.write(second, at + 50_000_000, bytes(store.serialize_ros1(marked, person)))
    with zipfile.ZipFile(tmp_path / "a.bag.zip", "w") as packed:
        packed.write(tmp_path / "a.bag", "a.bag")
    (seen,) = people.annotated(tmp_path / "a.bag.zip")
    np.testing.assert_allclose(seen.t, t, atol=1e-6)
    np.testing.assert_allclose(seen.centroids, people.seen_of(log, t, places, np.arange(len(t))).centroids, atol=1e-5)


def test_numbers_are_written_with_the_table_beside_the_report(tmp_path):
    """People.json holds every number; the table stands between its marks, simulated and real apart."""
    what = {"claim": "centroid", "number": "local_noise_mm", "meaning": "noise [mm]", "hidden_s": None}
    what |= {"noise_mm": 0.0, "unit": "stretch of 10 s"}
    real = people.measured([1.0, 2.0, 3.0, np.nan], people="real", source="three people", **what)
    simulated = people.measured([5.0], people="simulated", source="a torso", **what)
    assert (real.n, real.mean) == (3, 2.0) and real.low == pytest.approx(2 - 4.3027 / np.sqrt(3), abs=1e-3)
    (tmp_path / "study").mkdir()
    report = tmp_path / "REPLICATION.md"
    report.write_text("# A\n<!-- people: begin -->\nold\n<!-- people: end -->\nmore\n")
    people.publish([real, simulated], tmp_path / "study")
    row = "| `centroid` | noise [mm] |  | torso: no interval | three people: 2 [-0.484, 4.48] |"
    assert row in report.read_text() and "old" not in report.read_text()
    kept = json.loads((tmp_path / "study" / "people.json").read_text())
    assert [each["people"] for each in kept] == ["real", "simulated"]


# ---- what is published

PUBLISHED = [people.Number(**each) for each in json.loads((ROOT / "study" / "people.json").read_text())]


def test_real_and_simulated_people_are_told_apart_and_of_both_there_is_every_number():
    """Each number of each claim with its noise and time hidden is there for both, with its source."""
    sides = {}
    for each in PUBLISHED:
        key = each.claim, each.number, each.noise_mm, each.hidden_s
        sides.setdefault(each.people, set()).add(key)
        assert each.source and each.unit and each.n >= 5
        assert each.low <= each.mean <= each.high
    assert sides["real"] == sides["simulated"]
    assert {claim for claim, *_ in sides["real"]} == {"velocity", "prediction", "centroid", "interpolation"}


@external
def test_published_numbers_are_those_of_the_recordings():
    """Of the shortest time hidden, without noise, everybody predicted anew; and the noise of one bag."""
    folder = Path(os.environ[people.DATA])
    walks = [people.even_walk(walk) for walk in read_walks(folder / "walks")]
    assert len(walks) == 110
    errors = []
    for half in (0, 1):
        mine, other = walks[half::2], walks[1 - half :: 2]
        errors.append(people.errors_when_hidden(mine, mine, people.best_motion(other, other, 2), 4)[0])
    found = [each for each in PUBLISHED if (each.number, each.people, each.noise_mm) == ("velocity_m", "real", 0.0)]
    assert np.nanmean(np.hstack(errors)) == pytest.approx(found[0].mean, rel=1e-3)
    assert found[0].hidden_s == 0.4 and found[0].n == np.isfinite(np.hstack(errors)).sum()
