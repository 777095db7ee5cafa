"""What the README tells its readers to type runs as it is written, one after the other, in a fresh folder."""

import io
import re
import shlex
import shutil
from contextlib import redirect_stdout

import numpy as np
import pytest
from places import ROOT

from dollop.cli import main

README = (ROOT / "README.md").read_text(encoding="utf-8")
SCRIPT = ROOT / "examples" / "own_robot.py"
COMMANDS = re.findall(r"^    (dollop .+)$", README, re.MULTILINE)
BLOCKS = re.findall(r"^```python\n(.+?)^```$", README, re.MULTILINE | re.DOTALL)


def run_command(line):
    """What a command of the README says; it must end with status 0."""
    with redirect_stdout(io.StringIO()) as said:
        main(shlex.split(line, comments=True)[1:])
    return said.getvalue()


def run_block(text):
    """Names that a block of Python has defined in the end."""
    names = {}
    with redirect_stdout(io.StringIO()):
        exec(compile(text, "README.md", "exec"), names)
    return names


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """A folder in which every command was run, and what each said."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(ROOT / "data", folder / "data")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yield folder, {line: run_command(line) for line in COMMANDS}


def test_every_command_of_the_readme_writes_what_it_names(followed):
    """With status 0, each says what it wrote, and that is there."""
    folder, said = followed
    assert len(said) == len(COMMANDS) >= 8
    for line, text in said.items():
        wrote = re.search(r"^wrote (.+?)(?:; next: .+)?$", text, re.MULTILINE)
        assert wrote, line
        assert all((folder / name).is_file() for name in wrote[1].split(", ")), line


def test_from_a_log_and_a_map_to_a_performed_task_it_takes_four_commands(followed):
    """The first four of the README, and the last of them says that the task is finished."""
    words = [line.split()[1] for line in COMMANDS]
    assert words[:4] == ["map", "learn", "adapt", "perform"]
    assert followed[1][COMMANDS[3]].startswith("finished after")


def test_every_block_of_python_of_the_readme_runs(followed):
    """In its order, on what the commands wrote; the task of the first is finished by its robot."""
    found = list(map(run_block, BLOCKS))
    assert len(found) == 2 and found[0]["run"].finished and found[0]["observation"].trusted


def test_the_readme_shows_the_robot_of_ones_own_as_it_is():
    """The script, to the letter, and in at most twenty-five lines."""
    text = SCRIPT.read_text(encoding="utf-8")
    assert text in BLOCKS and len(text.splitlines()) <= 25


def test_a_robot_of_ones_own_does_the_same_by_perform_and_in_a_loop_of_its_own(followed):
    """Both runs are finished, without a touch, and agree to the last digit; the radius is the robot's own."""
    names = run_block(SCRIPT.read_text(encoding="utf-8"))
    performed, own = names["run"], names["controller"].run()
    assert performed.finished and own.finished and performed.collisions == 0
    assert np.array_equal(performed.poses, own.poses) and np.array_equal(performed.clearance, own.clearance)
    assert performed.radius == own.radius == names["Cart"].radius
    assert performed.notes == own.notes == ()
