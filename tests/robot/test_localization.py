"""Monte Carlo localisation: it follows, notices a kidnapping, and believes nothing too early."""

import tracemalloc

import numpy as np
import pytest
from rooms import ANGLES, CANS, FURNITURE, WALLS, drawn_map, room_map, scan

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.pose import motion_between
from dollop.robot import localization
from dollop.robot.localization import (
    LikelihoodField,
    Localisation,
    MonteCarloLocalizer,
    lattice,
    mean_pose,
    moved_particles,
    softmax,
)

RULES = Localisation()
ROOM = np.vstack([WALLS, FURNITURE])
START = np.array([4.5, 3.6, -0.7])
WRONG = [1.03, 1.0, 0.97]  # what the odometry makes of a motion


@pytest.fixture(scope="module")
def background():
    return room_map()


def compose(pose, motion):
    """The pose after a motion, as `motion_between` has it."""
    ahead, left, turn = motion
    middle = pose[2] + turn / 2
    dx = ahead * np.cos(middle) - left * np.sin(middle)
    dy = ahead * np.sin(middle) + left * np.cos(middle)
    return np.array([pose[0] + dx, pose[1] + dy, pose[2] + turn])


def follow(localizer, pose, motions, rng, boxes=ROOM):
    """Drive with an odometry 3 % wrong: true poses (N, 3), estimates, and whether believed."""
    records = []
    for motion in motions:
        pose = compose(pose, motion)
        localizer.update(motion * WRONG, scan(pose, boxes, rng))
        records.append((pose, localizer.pose, localizer.localised))
    return [np.array(column) for column in zip(*records, strict=True)]


def errors(truth, estimate):
    """Distance in m and angle in rad between poses (N, 3)."""
    turn = np.angle(np.exp(1j * (truth - estimate)[:, 2]))
    return np.linalg.norm((truth - estimate)[:, :2], axis=1), np.abs(turn)


TURNING = np.tile([0.0, 0.0, 0.05], (80, 1))
DRIVING = np.column_stack([np.full(200, 0.05), np.zeros(200), 0.04 * np.sin(np.arange(200) / 15)])


@pytest.mark.parametrize("boxes", [ROOM, np.vstack([ROOM, CANS])], ids=["as mapped", "with cans"])
def test_it_follows(background, boxes):
    """The odometry drifts by 20 cm; the mean error stays within 5 cm and 3 degrees."""
    start = drifted = np.array([1.5, 2.2, 0.0])
    localizer = MonteCarloLocalizer(background, ANGLES, pose=start, seed=0)
    rng = np.random.default_rng(1)
    truth, estimate, believed = follow(localizer, start, DRIVING[:130], rng, boxes)
    place, turn = errors(truth, estimate)
    for motion in DRIVING[:130]:
        drifted = compose(drifted, motion * WRONG)
    assert np.hypot(*(truth[-1] - drifted)[:2]) > 0.20 > 10 * place[-1]
    assert place.mean() < 0.05 and np.degrees(turn.mean()) < 3
    assert believed.mean() > 0.97
    assert len(localizer.particles) == RULES.tracking


def test_it_finds_itself_anywhere(background):
    """Set down anywhere and turning, it believes the right pose, never a wrong one: 10 of 10."""
    rng = np.random.default_rng(3)
    for seed in range(10):
        pose = np.array([*rng.uniform([1.0, 1.2], [8.0, 3.0]), rng.uniform(-np.pi, np.pi)])
        localizer = MonteCarloLocalizer(background, ANGLES, seed=seed)
        turning, boxes = np.tile(TURNING, (2, 1)), np.vstack([ROOM, CANS])
        truth, estimate, believed = follow(localizer, pose, turning, rng, boxes)
        place, turn = errors(truth, estimate)
        assert believed[-1], pose
        assert place[believed].max() < 0.15 and np.degrees(turn[believed].max()) < 5


def test_it_notices_a_kidnapping_and_finds_itself(background):
    """Carried off, it doubts the next scans, and after turning believes the new pose: 10 of 10."""
    rng = np.random.default_rng(4)
    for seed in range(10):
        localizer = MonteCarloLocalizer(background, ANGLES, pose=START, seed=seed)
        _, _, believed = follow(localizer, START, DRIVING[:15], rng)
        assert believed.all()
        pose = np.array([*rng.uniform([1.0, 1.2], [8.0, 3.0]), rng.uniform(-np.pi, np.pi)])
        truth, estimate, believed = follow(localizer, pose, TURNING, rng)
        place, _ = errors(truth, estimate)
        assert not believed[2] and believed[-1]
        assert place[-1] < 0.10


def test_a_pose_is_not_believed_before_half_a_turn(background):
    """However well a scan fits, a pose is believed only after half a turn; standing, never."""
    rng = np.random.default_rng(5)
    localizer = MonteCarloLocalizer(background, ANGLES, seed=0)
    standing = follow(localizer, START, np.zeros((30, 3)), rng)[2]
    assert not standing.any()
    believed = follow(localizer, START, TURNING, rng)[2]
    assert believed.argmax() * 0.05 * 0.97 >= RULES.believed_after - 0.1


def test_alike_from_two_sides():
    """In a bare room two poses are alike: particles come to stand at both, none is believed."""
    walls = np.array([[-0.1, 0, 0, 6], [8, 0, 8.1, 6], [-0.1, -0.1, 8.1, 0], [-0.1, 6, 8.1, 6.1]])
    pose, rng = np.array([2.0, 2.0, 0.3]), np.random.default_rng(6)
    localizer = MonteCarloLocalizer(drawn_map(walls, 8.0, 6.0), ANGLES, seed=0)
    truth, _, believed = follow(localizer, pose, TURNING, rng, walls)
    other = np.array([8.0, 6.0, np.pi]) + [-1, -1, 1] * truth[-1]
    here, there = (errors(each, localizer.particles)[0] < 0.10 for each in (truth[-1], other))
    assert (here | there).all() and here.any() and there.any()
    assert not believed.any()


def test_doubt_and_belief_by_hand(background):
    """Bad scans are doubted, good ones forgive, three are a kidnapping; a vain turn starts anew."""
    localizer = MonteCarloLocalizer(background, ANGLES, pose=START)
    states = []
    for fit in (0.9, 0.5, 0.5, 0.8, *[0.5] * 3):
        localizer.fit = fit
        localizer._judge(0.0)
        states.append((localizer.localised, localizer.converged))
    good, doubted, kidnapped = (True, True), (False, True), (False, False)
    assert states == [good, doubted, doubted, good, doubted, doubted, kidnapped]
    assert localizer._usual_fit == pytest.approx(0.99 * (0.99 * 0.8 + 0.01 * 0.9) + 0.01 * 0.8)
    localizer.particles, localizer.spread, localizer.fit = np.zeros((5, 3)), np.ones(2), 0.9
    for _ in range(2):
        localizer._judge(1.02 * np.pi)
    assert localizer.particles is None and localizer._turned == 0 and not localizer.converged


def test_a_strange_room_is_never_believed(background):
    """Where the map explains nothing, no pose is believed, however long it turns."""
    hall = [[-8.1, -9.0, -8.0, 9.0], [8.0, -9.0, 8.1, 9.0]]
    hall = np.array([*hall, [-9.0, -9.1, 9.0, -9.0], [-9.0, 9.0, 9.0, 9.1]])
    localizer = MonteCarloLocalizer(background, ANGLES, seed=0)
    turning, rng = np.tile(TURNING, (4, 1)), np.random.default_rng(0)
    believed = follow(localizer, np.array([1.0, 2.0, 0.0]), turning, rng, hall)[2]
    assert not believed.any()


def test_known_boxes_fit_better(background):
    """The boxes of the environment explain the beams that end on them."""
    ranges = scan(START, np.vstack([ROOM, CANS]))
    fits = []
    for environment in (None, Environment(CANS)):
        localizer = MonteCarloLocalizer(background, ANGLES, environment, START, seed=0)
        localizer.update((0.0, 0.0, 0.0), ranges)
        fits.append(localizer.fit)
    assert fits[1] > fits[0] + 0.02


def test_same_seed_same_pose(background):
    """The same seed and the same scans give the same poses."""
    runs = []
    for _ in range(2):
        localizer = MonteCarloLocalizer(background, ANGLES, seed=7)
        runs.append(follow(localizer, START, TURNING[:20], np.random.default_rng(8))[1])
    assert (runs[0] == runs[1]).all()


def test_field_against_the_formula(background):
    """Looked up or computed from its definition, the likelihood of a scan is the same."""
    grid = background.origin, background.resolution
    field = LikelihoodField(background.distance_field(), RULES.sigma, *grid)
    rng = np.random.default_rng(0)
    poses = np.column_stack([rng.uniform([1, 1], [8, 6], (20, 2)), rng.uniform(-3, 3, 20)])
    ends = rng.uniform(-1, 1, (9, 2))
    for pose, value in zip(poses, field.log_likelihoods(poses, ends), strict=True):
        turn = np.array([[np.cos(pose[2]), -np.sin(pose[2])], [np.sin(pose[2]), np.cos(pose[2])]])
        distances = background.distance_at(pose[:2] + ends @ turn.T)
        q = np.where(np.isnan(distances), 0.0, np.exp(-0.5 * (distances / RULES.sigma) ** 2))
        assert value == pytest.approx(np.log(RULES.floor + (1 - RULES.floor) * q).sum(), rel=1e-4)


def test_beams_beyond_the_map_explain_nothing(background):
    """A beam that ends off the map, however far, counts the floor and breaks nothing."""
    grid = background.origin, background.resolution
    field = LikelihoodField(background.distance_field(), RULES.sigma, *grid)
    ends = np.array([[1e6, 0.0], [0.0, -50.0]])
    assert field.log_likelihoods(START[None], ends) == pytest.approx([2 * np.log(RULES.floor)])


def test_lattice_agrees_with_particles(background):
    """Moving beams by whole cells scores a place as the exact way does, but for a cell's share."""
    grid = background.origin, background.resolution
    field = LikelihoodField(background.distance_field(), 0.2, *grid)
    places = np.random.default_rng(0).uniform([1, 1], [8, 6], (200, 2))
    ends = np.random.default_rng(1).uniform(-3, 3, (30, 2))
    exact = field.log_likelihoods(np.column_stack([places, np.full(200, 0.7)]), ends)
    (scores,) = field.lattice_log_likelihoods(places, [0.7], ends)
    assert np.corrcoef(exact, scores)[0, 1] > 0.98


def test_the_lattice_counts_beams_that_end_beyond_the_map(background):
    """Moved by whole cells, a beam that leaves the map, however far, counts the floor, from any place."""
    grid = background.origin, background.resolution
    field = LikelihoodField(background.distance_field(), 0.2, *grid)
    places = np.random.default_rng(0).uniform([0, 0], [9, 7], (50, 2))
    for ends in ([[12.0, 0.0], [0.0, -50.0]], [[1e6, 0.0]], [[0.0, -9.5]]):
        (scores,) = field.lattice_log_likelihoods(places, [0.0], np.array(ends))
        assert scores == pytest.approx(np.full(50, len(ends) * np.log(RULES.floor)))


def test_of_many_poses_the_most_promising_are_weighed(background, monkeypatch):
    """Sixteen in a square: of as few as one in fifteen the best hundred of all are there, with their scores."""
    localizer, rng = MonteCarloLocalizer(background, ANGLES), np.random.default_rng(0)
    few = len(localizer._lattice) * RULES.headings // 15
    for _ in range(5):
        pose = np.array([*rng.uniform([1.0, 1.2], [8.0, 3.0]), rng.uniform(-np.pi, np.pi)])
        ends = localizer._beam_ends(scan(pose, ROOM, rng))[::2]
        every, scores = localizer.lattice_scores(ends)
        assert np.array_equal(every, np.arange(len(localizer._lattice) * RULES.headings))
        with monkeypatch.context() as patch:
            patch.setattr(localization, "MOST_POSES", few)
            chosen, weighed = localizer.lattice_scores(ends)
        assert len(chosen) <= few and (np.diff(chosen) > 0).all()
        assert np.array_equal(weighed, scores[chosen])
        assert np.isin(np.argsort(-scores)[:100], chosen).all()


def test_a_square_promises_at_least_what_its_places_have(background):
    """The bound that the choice rests on: with a reach no place within it is better, wherever beams end."""
    grid = background.origin, background.resolution
    field = LikelihoodField(background.distance_field(), 0.2, *grid)
    cells = np.random.default_rng(2).integers(0, 130, (300, 2))
    ends = np.random.default_rng(3).uniform(-9, 9, (20, 2))
    (promised,) = field.lattice_log_likelihoods(background.cell_centres(cells), [0.4], ends, reach=7)
    for ahead in ((0, 0), (6, 6), (3, 5), (0, 6)):
        (scores,) = field.lattice_log_likelihoods(background.cell_centres(cells + ahead), [0.4], ends)
        assert (scores <= promised + 1e-4).all()


def test_a_localizer_takes_some_bytes_a_cell():
    """40 a cell to begin, 16 to follow and 70 to search, where beams are short: of 16 million less than 1 GiB.

    However long a beam is, the border where it may end is no wider than the map.
    """
    rng = np.random.default_rng(0)
    background = OccupancyGrid((rng.random((700, 900)) < 0.5).astype(float), (0.0, 0.0), 0.05)
    cells = background.occupancy.size
    tracemalloc.start()
    localizer = MonteCarloLocalizer(background, ANGLES, pose=[1.0, 1.0, 0.0])
    now, most = tracemalloc.get_traced_memory()
    assert now < 16 * cells and most < 40 * cells
    for reach, allowed in ((3.0, 70), (1e6, 140)):
        tracemalloc.reset_peak()
        localizer.lattice_scores(np.array([[reach, 0.0]]))
        assert tracemalloc.get_traced_memory()[1] < allowed * cells + 100 * localization.MOST_POSES
    tracemalloc.stop()


def test_the_lattice_holds_free_places_fifteen_centimetres_apart(background):
    """Every third cell of 5 cm that is free; of a map too narrow for that all free cells."""
    places = lattice(background.free, background, RULES)
    assert background.free[tuple(background.world_to_cell(places).T)].all()
    for axis in (0, 1):
        np.testing.assert_allclose(np.diff(np.unique(places[:, axis].round(6))), 0.15)
    assert len(places) == pytest.approx(background.free.sum() / 9, rel=0.05)
    slit = OccupancyGrid(np.pad(np.zeros((1, 5)), 1, constant_values=1), (0.0, 0.0), 0.05)
    assert len(lattice(slit.free, slit, RULES)) == 5


def test_motion_between_inverts_compose():
    """The motion between two poses leads from the one to the other."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        before, motion = rng.uniform(-3, 3, 3), rng.uniform(-1, 1, 3)
        assert motion_between(before, compose(before, motion)) == pytest.approx(motion)


def test_moved_particles_go_where_the_motion_leads():
    """Through a turn, their mean is the composed pose and their spread the stated one."""
    start, motion = np.array([1.0, -2.0, 0.7]), (0.4, 0.1, 1.0)
    moved = moved_particles(np.tile(start, (20_000, 1)), motion, np.random.default_rng(0), RULES)
    np.testing.assert_allclose(moved.mean(axis=0), compose(start, motion), atol=0.005)
    c, s = np.cos(1.2), np.sin(1.2)
    way = np.hypot(0.4, 0.1)
    sd = ((moved - moved.mean(axis=0))[:, :2] @ [[c, -s], [s, c]]).std(axis=0)
    np.testing.assert_allclose(sd, [0.10 * way + 0.002, 0.05 * way + 0.002], rtol=0.05)
    assert moved[:, 2].std() == pytest.approx(0.10 + 0.05 * way + 0.002, rel=0.05)


def test_resampling_keeps_shares_and_a_robot_that_stands_keeps_its_particles(background):
    """Each is drawn as often as its weight says, to one; where nothing moved, none is drawn."""
    localizer = MonteCarloLocalizer(background, ANGLES, pose=START)
    particles = localizer.particles
    localizer.update((0.0, 0.0, 0.0), scan(START, ROOM))
    assert localizer.particles is particles
    localizer.particles = np.arange(5.0)[:, None] * np.ones(3)
    weights = np.array([0.1, 0.0, 0.5, 0.15, 0.25])
    drawn = np.bincount(localizer._resampled(weights)[:, 0].astype(int), minlength=5)
    assert drawn.sum() == RULES.tracking and np.abs(drawn - RULES.tracking * weights).max() <= 1


def test_the_laser_is_ahead_of_the_robot(background):
    """Beams end farther ahead by the laser's offset, in the robot's frame."""
    localizers = (MonteCarloLocalizer(background, ANGLES, laser_offset=x) for x in (0, 0.3))
    here, ahead = (localizer._beam_ends(np.full(181, 2.0)) for localizer in localizers)
    np.testing.assert_allclose(ahead - here, np.tile([0.3, 0.0], (len(here), 1)))
    np.testing.assert_allclose(here[[0, 30, 60]], [[0, -2], [2, 0], [0, 2]], atol=1e-12)


def test_mean_pose_of_headings_round_pi():
    """Headings just above and below pi have their mean at pi, not at zero, and a small spread."""
    particles = np.array([[1.0, 2.0, np.pi - 0.1], [1.0, 2.0, -np.pi + 0.1]])
    pose, spread = mean_pose(particles, np.array([0.5, 0.5]))
    assert abs(pose[2]) == pytest.approx(np.pi)
    assert spread == pytest.approx([0.0, 0.1], abs=1e-3)


def test_softmax_of_large_scores():
    """Scores that would overflow give shares that sum to one."""
    assert softmax(np.array([1e4, 1e4, -1e4])) == pytest.approx([0.5, 0.5, 0.0])


def test_scan_without_returns(background):
    """A scan in which nothing came back is survived, and believed to explain nothing."""
    localizer = MonteCarloLocalizer(background, ANGLES, seed=0)
    localizer.update((0.0, 0.0, 0.1), np.full(len(ANGLES), np.inf))
    assert len(localizer.particles) == RULES.searching and localizer.fit == 0.0
    assert np.isfinite(localizer.pose).all()


def test_the_rules_are_the_robots_own(background):
    """A robot that needs a whole turn to believe is not sure after half of one, and has its own particles."""
    rules = Localisation(believed_after=6.2, searching=1500, beam_step=6)
    localizer, rng = MonteCarloLocalizer(background, ANGLES, seed=0, rules=rules), np.random.default_rng(5)
    localizer.update((0.0, 0.0, 0.0), scan(START, ROOM, rng))
    assert len(localizer.particles) == 1500 and len(localizer._bearings) == 31
    believed = follow(localizer, START, np.tile(TURNING, (2, 1)), rng)[2]
    assert believed.any() and believed.argmax() * 0.05 * 0.97 >= 6.0


def test_a_strange_odometry_is_followed_by_rules_that_know_it(background):
    """Of an odometry 40 % off, the pose is lost by rules that trust it, and kept by those that do not."""
    lost = []
    for rules in (Localisation(), Localisation(along=0.5, turned=0.5)):
        localizer, rng = (
            MonteCarloLocalizer(background, ANGLES, pose=START, seed=0, rules=rules),
            np.random.default_rng(1),
        )
        pose, off = START, []
        for motion in DRIVING[:60]:
            pose = compose(pose, motion)
            localizer.update(motion * [1.4, 1.0, 0.6], scan(pose, ROOM, rng))
            off.append(np.hypot(*(localizer.pose - pose)[:2]))
        lost.append(np.mean(off))
    assert lost[1] < lost[0] / 1.5


BAD_RULES = {
    "sigma must be in 0.001": {"sigma": 0.0},
    "floor must be in 0.001 to 0.999": {"floor": 1.0},
    "independent must be in 0 to 1": {"independent": 1.5},
    "doubts must be a whole number": {"doubts": 2.5},
    "headings must be a whole number, 1 to 3600": {"headings": 0},
    "along must be a finite number": {"along": "much"},
    "given_up_after must be at least believed_after, 5 rad, got 4": {"believed_after": 5, "given_up_after": 4},
}


@pytest.mark.parametrize("told", BAD_RULES)
def test_rules_that_are_none(told):
    """What is no number of its kind, or contradicts another, is refused with its name and rule."""
    with pytest.raises(ValueError, match=told):
        Localisation(**BAD_RULES[told])


def test_bad_input(background):
    """A start that is not finite and a map without a free cell are refused."""
    with pytest.raises(ValueError, match="pose must be finite"):
        MonteCarloLocalizer(background, ANGLES, pose=(np.nan, 0.0, 0.0))
    with pytest.raises(ValueError, match="free cell"):
        MonteCarloLocalizer(OccupancyGrid(np.ones((9, 9)), (0.0, 0.0), 0.05), ANGLES)
    with pytest.raises(ValueError, match="rules must be a Localisation, got None"):
        MonteCarloLocalizer(background, ANGLES, rules=None)
