"""Extras of the package that may be missing."""

import sys
import tomllib

import pytest
from places import ROOT

from dollop.checks import EXTRAS, need

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.mark.parametrize("extra", EXTRAS)
def test_what_is_missing_is_told_with_the_line_that_installs_it(extra, monkeypatch):
    """The error names the module and the extra, before anything has been done."""
    monkeypatch.setitem(sys.modules, EXTRAS[extra], None)
    line = rf'this needs {EXTRAS[extra]}: pip install "dollop\[{extra}\]"'
    with pytest.raises(ImportError, match=line) as caught:
        need(extra)
    assert ("wheels only for Linux" in str(caught.value)) == (extra == "lab")
    assert ("with a C compiler" in str(caught.value)) == (extra == "peers")


def test_what_is_there_passes(monkeypatch):
    """Whatever is installed is enough; it is not imported."""
    monkeypatch.setitem(EXTRAS, "lab", "this")
    assert need("lab") is None and "this" not in sys.modules


@pytest.mark.parametrize("extra", EXTRAS)
def test_the_extras_are_those_of_the_package(extra):
    """Each brings the module by which it is known."""
    assert EXTRAS[extra] in PROJECT["optional-dependencies"][extra]


def test_an_unknown_extra_is_refused():
    """The error lists the known ones."""
    with pytest.raises(ValueError, match="extra must be one of 'lab', .*, got 'laboratory'"):
        need("laboratory")
