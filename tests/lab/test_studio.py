"""The studio: pictures of what moves are laid over one of what stands, in the right place and the same each time."""

import numpy as np
import pytest

from dollop.lab.scenes import figure_eight_scene

pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")

from dollop.lab.render import Studio, camera

SIZE = 240, 200
PIECES = np.array([[(3.5, 1.5), (4.5, 1.5)], [(4.5, 1.5), (5.5, 1.5)]])


@pytest.fixture(scope="module")
def studio():
    """The laboratory with two cans, and two red strips that may lie on its floor."""
    with Studio(figure_eight_scene(), *SIZE) as studio:
        studio.lay(PIECES, (1.0, 0.0, 0.0))
        yield studio


def changed(picture, studio):
    """Where a picture is not as the empty room: (H, W) bool."""
    return np.abs(np.asarray(picture, dtype=int) - np.asarray(studio.empty())).max(axis=2) > 20


def test_the_robot_is_where_it_is_put(studio):
    """What has changed lies round its place in the picture, and nowhere else."""
    for pose in ((4.5, 2.0, 0.3), (6.0, 4.5, 2.0)):
        rows, columns = np.nonzero(changed(studio.robot_at(pose), studio))
        ((x, y),) = studio.pixels([pose[:2]])
        assert len(rows) > 30
        assert abs(columns.mean() - x) < 6 and abs(rows.mean() - y) < 8
        assert np.ptp(columns) < 35 and np.ptp(rows) < 35


def test_a_carried_robot_is_higher(studio):
    """Lifted, it is seen further up."""
    low, high = (changed(studio.robot_at((4.5, 2.0, 0.3), lifted=each), studio).nonzero()[0] for each in (0.0, 0.9))
    assert high.min() < low.min() - 10


def test_a_person_stands_on_the_place_named(studio):
    """Feet at the place, head far above it."""
    rows, columns = np.nonzero(changed(studio.person_at(np.array([4.5, 2.0]), 0.0, 0.5), studio))
    ((x, y),) = studio.pixels([(4.5, 2.0)])
    assert abs(columns[rows < y - 20].mean() - x) < 8
    assert -5 < rows.max() - y < 12 and rows.min() < y - 45


def test_the_same_picture_twice_is_the_same(studio):
    """However much has been moved in between."""
    first = studio.robot_at((5.0, 3.0, 1.0), strips=[0])
    for k in range(5):
        studio.person_at(np.array([4.0 + 0.3 * k, 2.5]), 0.2, 1.0 * k, strips=[0, 1])
    assert np.array_equal(first, studio.robot_at((5.0, 3.0, 1.0), strips=[0]))


def test_strips_lie_there_when_asked_for(studio):
    """Each in its place, in its colour, and none otherwise."""
    middles = studio.pixels(PIECES.mean(axis=1)).astype(int)
    for strips in ([], [0], [1], [0, 1]):
        picture = np.asarray(studio.robot_at((2.0, 5.0, 0.0), strips), dtype=int)
        red = [picture[y, x, 0] - picture[y, x, 1] > 50 for x, y in middles]
        assert red == [0 in strips, 1 in strips]


def test_the_camera_looks_at_its_target():
    """The target is in the middle of the picture, and what is higher further up."""
    eye, target = np.array([2.0, -3.0, 4.0]), np.array([4.0, 3.0, 0.0])
    seen = camera(eye, target, 45.0, *SIZE)
    across, down, depth = seen @ (target - eye)
    assert (across / depth, down / depth) == pytest.approx((120, 100))
    assert depth == pytest.approx(np.linalg.norm(target - eye))
    across, down, depth = seen @ (target + (0, 0, 1) - eye)
    assert across / depth == pytest.approx(120) and down / depth < 100
