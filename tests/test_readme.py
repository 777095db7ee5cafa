"""What the README and its pages tell their readers to type runs as it is written, in order, in a fresh folder."""

import ast
import io
import re
import shlex
import shutil
from contextlib import redirect_stdout

import numpy as np
import pytest
from places import ROOT

from dollop.cli import main

PAGES = ("README.md", "book/own_log.md", "book/own_robot.md")
TEXTS = {name: (ROOT / name).read_text(encoding="utf-8") for name in PAGES}
README = TEXTS["README.md"]
SCRIPT = ROOT / "examples" / "own_robot.py"
NAV2 = "nav2_simple_commander"
"""What only a machine with Nav2 can import: tests/test_own_log.py reads those blocks."""


def commands_of(text):
    """Every dollop command that stands on a line of its own."""
    return re.findall(r"^    (dollop .+)$", text, re.MULTILINE)


def blocks_of(text):
    """Every block of Python that runs without Nav2."""
    blocks = re.findall(r"^```python\n(.+?)^```$", text, re.MULTILINE | re.DOTALL)
    return [block for block in blocks if NAV2 not in block]


COMMANDS = commands_of(README)
ALL_COMMANDS = [line for text in TEXTS.values() for line in commands_of(text)]
BLOCKS = [block for text in TEXTS.values() for block in blocks_of(text)]


def run_command(line):
    """What a command says; it must end with status 0."""
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
        yield folder, {line: run_command(line) for line in dict.fromkeys(ALL_COMMANDS)}


def test_every_command_writes_what_it_names(followed):
    """With status 0, each says what it wrote, and that is there."""
    folder, said = followed
    assert len(said) >= 8
    for line, text in said.items():
        wrote = re.search(r"^wrote (.+?)(?:; next: .+)?$", text, re.MULTILINE)
        assert wrote, line
        assert all((folder / name).is_file() for name in wrote[1].split(", ")), line


def test_from_a_log_and_a_map_to_a_performed_task_it_takes_four_commands(followed):
    """Those of the README, which has no others, and the last of them says that the task is finished."""
    assert [line.split()[1] for line in COMMANDS] == ["map", "learn", "adapt", "perform"]
    assert followed[1][COMMANDS[3]].startswith("finished after")


def test_the_page_on_ones_own_log_begins_with_the_four_of_the_readme():
    """To the letter: whoever goes on reading there need not type anything twice."""
    assert commands_of(TEXTS["book/own_log.md"])[:4] == COMMANDS


def test_the_readme_is_read_in_thirty_seconds():
    """One sentence, two commands, four commands, then the figures, in that order; what comes before them is short."""
    places = [README.index(words) for words in ("**Show a", "make figures ", "make test ", "dollop map", "## Figures")]
    assert places == sorted(places)
    before = README[: README.index("## Figures")]
    assert len(before.splitlines()) <= 45 and not re.search(r"^\| figure", README, re.MULTILINE)


def test_every_block_of_python_runs(followed):
    """In its order, on what the commands wrote; the task of the first is finished by its robot."""
    found = list(map(run_block, BLOCKS))
    assert len(found) == 2 and found[0]["run"].finished and found[0]["observation"].trusted


def test_the_page_on_ones_own_robot_shows_the_example_as_it_is():
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


def test_every_picture_of_the_readme_is_there_and_told_in_words():
    """A file of the checkout, with an alternative text of at least four words."""
    pictures = re.findall(r"<img [^>]*>|!\[[^\]]*\]\([^)]*\)", README)
    assert len(pictures) >= 4
    for picture in pictures:
        found = re.search(r'src="(?P<a>[^"]+)"|\]\((?P<b>[^)]+)\)', picture)
        words = re.search(r'alt="([^"]*)"|!\[([^\]]*)\]', picture)
        assert (ROOT / (found["a"] or found["b"])).is_file(), picture
        assert len((words[1] or words[2] or "").split()) >= 4, picture


# ---- the notebooks, here and in a browser

NOTEBOOKS_PAGE = (ROOT / "book" / "notebooks.md").read_text(encoding="utf-8")
NOTEBOOKS = sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))
ROWS = dict(re.findall(r"^\| \[[^\]]+\]\(\.\./notebooks/(\S+)\) \|.*\| ([^|]+) \|$", NOTEBOOKS_PAGE, re.MULTILINE))
ADDRESSES = re.findall(r"^    (https://\S+)$", NOTEBOOKS_PAGE, re.MULTILINE)
SET_UP = re.search(r"^```\n(.+?)^```$", NOTEBOOKS_PAGE, re.MULTILINE | re.DOTALL)[1]


def test_every_notebook_has_its_row_and_says_whether_it_needs_pybullet():
    """Those that notebooks/conftest.py skips without PyBullet do not run, the others do."""
    text = (ROOT / "notebooks" / "conftest.py").read_text(encoding="utf-8")
    (skipped,) = (
        ast.literal_eval(node.value)
        for node in ast.parse(text).body
        if isinstance(node, ast.Assign) and node.targets[0].id == "NEEDS_PYBULLET"
    )
    assert list(ROWS) == [path.name for path in NOTEBOOKS]
    assert {name for name, runs in ROWS.items() if runs == "does not run"} == set(skipped)


def test_the_addresses_are_of_the_form_that_binder_and_colab_read():
    """Each has the place for owner and name once, and leads to what is in the checkout."""
    binder, colab = ADDRESSES
    assert re.fullmatch(r"https://mybinder\.org/v2/gh/OWNER/NAME/\w+\?urlpath=lab/tree/(\w+)", binder)
    path = re.fullmatch(r"https://colab\.research\.google\.com/github/OWNER/NAME/blob/main/(\S+)", colab)[1]
    assert (ROOT / binder.rpartition("/")[2]).is_dir() and (ROOT / path).is_file()
    assert "OWNER/NAME" in SET_UP


def test_the_readme_says_what_each_button_needs_and_leads_to_how():
    """The links lead to headings of the page, and that page says it at length."""
    names = re.findall(r"\(book/notebooks\.md#([\w-]+)\)", README)
    headings = re.findall(r"^#+ (.+)$", NOTEBOOKS_PAGE, re.MULTILINE)
    assert len(names) == 3 and set(names) <= {heading.lower().replace(" ", "-") for heading in headings}
    assert NOTEBOOKS_PAGE.count("**It needs**") == 2


def imports_of(path):
    """Packages of others that a notebook imports."""
    return set(re.findall(r'^ *"(?:from|import) (\w+)', path.read_text(encoding="utf-8"), re.MULTILINE))


def test_the_cell_for_colab_installs_what_the_notebooks_import():
    """The package with its dependencies, the extras named there, and what Colab itself has of Jupyter."""
    import sys
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    line = re.search(r'install --quiet "\.\.\[(.+)\]" (.+)', SET_UP)
    extras = [each for name in line[1].split(",") for each in project["optional-dependencies"][name]]
    brought = {*project["dependencies"], *extras, *line[2].split(), "dollop", "ipywidgets", "IPython", "nbformat"}
    wanted = set().union(*map(imports_of, NOTEBOOKS)) - set(sys.stdlib_module_names)
    assert {{"sklearn": "scikit-learn", "PIL": "pillow"}.get(name, name) for name in wanted} <= brought
