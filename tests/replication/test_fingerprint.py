"""Fingerprints: the same for the same program, another for another, near by or far off."""

import pytest

from dollop.replication import fingerprint
from dollop.replication.claims import CLAIMS
from dollop.replication.fingerprint import fingerprint_of_text, modules_behind

BEFORE = '''"""A module."""
from dollop.pose import wrap

@claim("I", "words", Criterion("n", "a number"))
def f(x):
    """What it is."""
    return x + 1  # why
'''
PROSE = '''"""A module about something else."""
from dollop.pose import wrap
LENGTH_OF = None

@claim("II", "other words", Criterion("n", "the number", (0, 1)))
def f(x):
    return (
        x + 1
    )
'''


def digest(folder, text, **beside):
    """The digest of a module of such a text, and of files beside it."""
    place = folder / str(len(list(folder.iterdir())))
    place.mkdir()
    for name, content in beside.items():
        (place / f"{name}.json").write_text(content)
    (place / "module.py").write_text(text)
    return fingerprint._digest(place / "module.py")


def test_prose_changes_nothing_and_the_program_everything(tmp_path):
    """Comments, docstrings, layout and what a claim quotes and wants are prose; a number is not."""
    before = digest(tmp_path, BEFORE)
    assert digest(tmp_path, PROSE.replace("LENGTH_OF = None\n", "")) == before
    assert digest(tmp_path, PROSE) != before
    assert digest(tmp_path, BEFORE.replace("x + 1", "x + 2")) != before


def test_files_that_a_module_names_belong_to_it(tmp_path):
    """What is read from beside the code is a part of it, other files are not."""
    text = 'PATH = Path(__file__).with_name("chosen.json")\n'
    first = digest(tmp_path, text, chosen="1")
    assert first == digest(tmp_path, text, chosen="1", other="2") != digest(tmp_path, text, chosen="2")


def test_whatever_is_imported_is_behind_a_claim():
    """From the experiment down to the lowest module, in functions too, but not what only other claims need."""
    behind = {id: set(modules_behind(claim.experiment.__module__)) for id, claim in CLAIMS.items()}
    for modules in behind.values():
        assert {"dollop.replication.recordings", "dollop.observation", "dollop.pose", "dollop.lab.engine"} <= modules
        assert not modules & {"dollop.cli", "dollop.replication.study", "dollop.replication.running"}
    assert "dollop.replication.claims.law" not in behind["centroid"]


def test_a_package_that_makes_its_names_when_asked_brings_in_all_of_them():
    """The laboratory does: who imports it may use anything in it."""
    assert {"dollop.lab.world", "dollop.lab.scanner"} < set(modules_behind("dollop.lab"))


def test_what_only_draws_is_behind_no_number():
    """A claim may import what draws, as the laboratory's door does; those modules draw, and hand back no numbers."""
    assert not fingerprint.PICTURES & {each for claim in CLAIMS.values() for each in behind(claim)}
    assert set(modules_behind("dollop.lab", *fingerprint.PICTURES)) > fingerprint.PICTURES
    for name in fingerprint.PICTURES:
        assert fingerprint._source(name).is_file()


def behind(claim):
    """The modules behind a claim."""
    return modules_behind(claim.experiment.__module__)


def test_what_has_no_source_is_refused():
    """A fingerprint of nothing would be that of any code."""
    with pytest.raises(ValueError, match="nowhere has no source"):
        fingerprint.fingerprint("nowhere")


def test_texts_are_told_apart_by_their_order():
    """The fingerprint of criteria is of all of them, one after the other."""
    assert fingerprint_of_text("a", "b") != fingerprint_of_text("b", "a")
