"""The files around the code: they parse, and agree with one another."""

import ast
import re
import sys
import tomllib

import pytest
from places import ROOT

import dollop

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
CODE = sorted((ROOT / "dollop").rglob("*.py"))
DISTRIBUTIONS = {"sklearn": "scikit-learn", "PIL": "pillow", "yaml": "pyyaml"}  # where the two names differ
PLACES = {  # where an extra may be imported
    "lab": "dollop/lab/engine.py",
    "films": "dollop/replication/films",
    "notebooks": ("dollop/replication/toys", "dollop/replication/teaching", "dollop/replication/films"),
    "ros": ("dollop/formats/ros_bag", "dollop/replication/people.py"),
    "baseline": "dollop/replication/baseline.py",
    "peers": "dollop/replication/peers.py",
    "cluster": "dollop/replication/running.py",
}
LOCK = (ROOT / "environment.txt").read_text().splitlines()


def parsed(path):
    """Content of a YAML file; the test is skipped where there is nothing to read it with."""
    yaml = pytest.importorskip("yaml", reason="reading YAML needs PyYAML")
    return yaml.safe_load(path.read_text())


def steps_of(path):
    """Every step of every job of a workflow."""
    return [step for job in parsed(path)["jobs"].values() for step in job["steps"]]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_every_workflow_calls_make_test(path):
    """Continuous integration does what `make test` does; what publishes the book does what `make book` does.

    That one has nothing to test: what lands on main is tested by the workflow for pull requests at the same time, and
    `make book` executes the notebooks, whose checks fail it.
    """
    target = "make book" if path.stem == "book" else "make test"
    assert target in [step.get("run") for step in steps_of(path)]


def test_the_book_is_published_from_main_as_make_book_lays_it_out():
    """The folder that book/build.py writes; only the job that publishes it may write anything."""
    workflow = parsed(ROOT / ".github" / "workflows" / "book.yml")
    assert workflow[True]["push"] == {"branches": ["main"]} and workflow["permissions"] == {"contents": "read"}
    build, publish = workflow["jobs"]["build"], workflow["jobs"]["publish"]
    assert [step["with"]["path"] for step in build["steps"] if "pages" in step.get("uses", "")] == ["build/book"]
    assert 'ROOT / "build" / "book"\n' in (ROOT / "book" / "build.py").read_text(encoding="utf-8")
    assert "permissions" not in build and publish["permissions"] == {"pages": "write", "id-token": "write"}
    assert publish["needs"] == "build"


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_actions_are_pinned_to_commits(path):
    """A tag can be moved to other code, a commit cannot; its version stands beside it."""
    lines = [line.strip() for line in path.read_text().splitlines() if "uses:" in line]
    assert len(lines) == sum("uses" in step for step in steps_of(path)) > 0
    pinned = re.compile(r"- uses: [\w-]+/[\w-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")
    assert all(pinned.fullmatch(line) for line in lines)


def test_an_action_is_of_one_version_everywhere():
    """Two workflows do not pin one action to two commits."""
    used = {step["uses"] for path in WORKFLOWS for step in steps_of(path) if "uses" in step}
    assert len(used) == len({action.split("@")[0] for action in used})


def test_pull_requests_are_tested_with_the_lab_and_without():
    """With it on Linux; without it as a wheel on three systems and all Pythons of the package."""
    jobs = parsed(ROOT / ".github" / "workflows" / "pull-request.yml")["jobs"]
    lab = [step.get("run") for step in jobs["lab"]["steps"]]
    assert {"make check", "make test", "make coverage"} <= set(lab)
    assert jobs["method"]["steps"][-1]["run"] == "python .ci/wheel_test.py"
    matrix = jobs["method"]["strategy"]["matrix"]
    assert matrix["system"] == ["ubuntu-latest", "macos-latest", "windows-latest"]
    told = [line.split(" :: ")[-1] for line in PROJECT["classifiers"]]
    assert matrix["python"] == [version for version in told if re.fullmatch(r"3\.\d+", version)]


def test_there_is_a_workflow_for_pull_requests_and_one_for_every_month():
    """Pull requests are tested with the lock; once a month, also without it."""
    events = {path.stem: parsed(path)[True] for path in WORKFLOWS}  # YAML reads "on" as true
    assert "pull_request" in events["pull-request"]
    assert "schedule" in events["monthly"]
    monthly = parsed(ROOT / ".github" / "workflows" / "monthly.yml")["jobs"]["test"]
    assert monthly["strategy"]["matrix"] == {"versions": ["pinned", "unpinned"]}


def test_the_citation_is_of_this_version_and_names_the_paper():
    """CITATION.cff, the package and the changelog tell the same version; the authors agree."""
    citation = parsed(ROOT / "CITATION.cff")
    assert citation["version"] == dollop.__version__
    assert citation["license"] == PROJECT["license"]
    paper = citation["references"][0]
    assert [author["family-names"] for author in paper["authors"]] == ["Dixon", "Khosla"]
    assert citation["authors"] == PROJECT["authors"]
    assert citation["keywords"] == PROJECT["keywords"]
    assert f"## {dollop.__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_the_lock_is_names_and_versions_in_order():
    """One name==version a line, sorted, no addresses."""
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+( ; .+)?", line) for line in LOCK)
    names = [line.split("==")[0].lower() for line in LOCK]
    assert names == sorted(names)


def plain(requirement):
    """Name of a distribution as indexes compare it."""
    return re.match(r"[\w.-]+", requirement)[0].lower().replace("_", "-")


def test_every_dependency_is_in_the_lock():
    """What pyproject.toml asks for, extras included, has a pinned version."""
    wanted = PROJECT["dependencies"] + sum(EXTRAS.values(), [])
    assert {plain(name) for name in wanted} - {"dollop"} <= {plain(line) for line in LOCK}


def imports_of(path):
    """What a module imports anywhere of other people, by the names that indexes know."""
    tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    names = set()
    for node in tree:
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(node.module.split(".")[0])
    others = names - {"dollop", *sys.stdlib_module_names}
    return {DISTRIBUTIONS.get(name, name) for name in others}


@pytest.mark.parametrize("path", CODE, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_import_is_a_dependency_or_of_the_extra_that_the_module_needs(path):
    """No module imports what an installation with its extra would not bring."""
    module = path.relative_to(ROOT).as_posix()
    extras = [name for name, place in PLACES.items() if module.startswith(place)]
    brought = {*PROJECT["dependencies"], *sum((EXTRAS[name] for name in extras), [])}
    assert imports_of(path) <= brought


def test_make_help_lists_every_target():
    """Each target that is no file has its line in the help."""
    text = (ROOT / "Makefile").read_text()
    targets = re.search(r"^\.PHONY: (.+)$", text, re.MULTILINE)[1].split()
    assert set(re.findall(r"^([a-z]+):.*##", text, re.MULTILINE)) == set(targets)
    assert {"figures", "test", "fast", "coverage", "check", "book"} <= set(targets)


def test_binder_uses_the_lock_and_its_python():
    """Binder installs the versions that the tests ran with."""
    binder = ROOT / "binder"
    named = (binder / "requirements.txt").read_text().split()[1]
    assert (binder / named).resolve() == ROOT / "environment.txt"
    assert (binder / "runtime.txt").read_text().strip() == "python-3.11"
