"""Records at a prompt: each prints itself in a line or two, however long its arrays."""

import numpy as np
import pytest
from places import DATA

import dollop
from dollop.lab import Recording


@pytest.fixture(scope="module")
def records():
    """One of each kind, from two recordings of the laboratory."""
    background = dollop.OccupancyGrid.load(DATA / "lab.yaml")
    recording = Recording.load(DATA / "figure_eights.log.gz")
    observation = dollop.observe(recording.log, background)
    shown = dollop.Demonstration.of(observation)
    task, law = dollop.learn([shown, shown]), shown.law
    frames = dollop.Frames(task.environment.centres, np.zeros(2))
    tied = dollop.associate_with_frames([law.subgoals], [frames])
    robot = dollop.Unicycle((*law.start, 0.0))
    matching = dollop.match(task.environment, task.environment)
    run = dollop.perform(task, robot, background=background)
    seen = (recording, recording.log, recording.scene, background, observation, observation.user)
    learned = (shown, task, law, law.segments[0], task.model, task.association)
    return (*seen, *learned, frames, tied, matching, task.environment, robot, run)


def test_every_record_prints_in_a_line_or_two(records):
    """Its kind comes first; no arrays in full."""
    for record in records:
        text = repr(record)
        assert text.startswith(type(record).__name__)
        assert len(text) < 200 and "array(" not in text and "\n" not in text, text


def test_what_is_told_is_what_is_there(records):
    """Counts and places in the words are those of the record."""
    told = {type(record).__name__: repr(record) for record in records}
    assert "929 scans" in told["LaserLog"] and "181 beams" in told["LaserLog"]
    assert "6 segments" in told["SequencedLDS"] and "shown 2 x" in told["Task"]
    assert "cylinder (2.50, 3.60)" in told["Scene"] and "finished" in told["Run"]
    assert repr(dollop.Environment([])) == "Environment of 0 objects"
