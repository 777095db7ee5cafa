"""The files around the code: they parse, and agree with one another."""

import re
import tomllib

import pytest
from places import ROOT

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
LOCK = (ROOT / "environment.txt").read_text().splitlines()


def parsed(path):
    """Content of a YAML file; the test is skipped where there is nothing to read it with."""
    yaml = pytest.importorskip("yaml", reason="reading YAML needs PyYAML")
    return yaml.safe_load(path.read_text())


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_every_workflow_calls_make_test(path):
    """Continuous integration does what `make test` does, and nothing cleverer."""
    jobs = parsed(path)["jobs"]
    assert all(any(step.get("run") == "make test" for step in job["steps"]) for job in jobs.values())


def test_there_is_a_workflow_for_pull_requests_and_one_for_every_month():
    """Pull requests are tested with the lock; once a month, also without it."""
    events = {path.stem: parsed(path)[True] for path in WORKFLOWS}  # YAML reads the key "on" as true
    assert "pull_request" in events["pull-request"]
    assert "schedule" in events["monthly"]
    assert parsed(ROOT / ".github" / "workflows" / "monthly.yml")["jobs"]["test"]["strategy"]["matrix"] == {
        "versions": ["pinned", "unpinned"]
    }


def test_the_citation_is_of_this_version_and_names_the_paper():
    """CITATION.cff, pyproject.toml and the changelog tell the same version."""
    citation = parsed(ROOT / "CITATION.cff")
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert [author["family-names"] for author in citation["references"][0]["authors"]] == ["Dixon", "Khosla"]
    assert f"## {PROJECT['version']}" in (ROOT / "CHANGELOG.md").read_text()


def test_the_lock_is_names_and_versions_in_order():
    """One name==version a line, sorted, no addresses."""
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+( ; .+)?", line) for line in LOCK)
    names = [line.split("==")[0].lower() for line in LOCK]
    assert names == sorted(names)


def test_every_dependency_is_in_the_lock():
    """What pyproject.toml asks for, extras included, has a pinned version."""
    locked = {line.split("==")[0].lower().replace("_", "-") for line in LOCK}
    wanted = PROJECT["dependencies"] + sum(PROJECT["optional-dependencies"].values(), [])
    assert {name.lower() for name in wanted} <= locked


def test_binder_uses_the_lock_and_its_python():
    """Binder installs the versions that the tests ran with."""
    binder = ROOT / "binder"
    assert (binder / (binder / "requirements.txt").read_text().split()[1]).resolve() == ROOT / "environment.txt"
    assert (binder / "runtime.txt").read_text().strip() == "python-3.11"
