"""The symbols of the notebooks: every letter means one thing, and the book's page of them has all."""

import json
import re

import pytest
from places import ROOT

NOTEBOOKS = {path.name[:2]: path for path in sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))}
PAGE = (ROOT / "book" / "symbols.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| (\$[^|]+) \| ([^|]+) \| ([^|]+) \| (\d\d) \|$", re.MULTILINE)
ROWS = [(re.findall(r"\$([^$]+)\$", symbols), meaning, first) for symbols, meaning, _, first in ROW.findall(PAGE)]
FORMULA = re.compile(r"\$\$(.+?)\$\$|\$([^$\n]+)\$", re.DOTALL)
WORDS = re.compile(r"\\(?:text|mathrm|operatorname)\{[^}]*\}")
INDEX = re.compile(r"_(?:\{[^}]*\}|\\?\w[a-z]*)")
LETTER = re.compile(r"\\[A-Za-z]+|dt|[A-Za-z]")
OPERATORS = r"""
\cdot \cos \dot \exp \frac \ge \in \infty \lceil \ldots \le \left \leftarrow \log \ne \neq \parallel \perp \pi \Pr \prod
\propto \qquad \quad \rceil \right \sin \sqrt \succeq \sum \tilde \times \to \top
"""
"""Operators, relations, numbers, brackets and spaces."""


def formulas_of(path):
    """The formulas of a notebook's prose, without the words in them."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    prose = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    prose = re.sub(r"(?s)```.*?```|`[^`\n]*`", "", prose)
    return [WORDS.sub(" ", shown or inline) for shown, inline in FORMULA.findall(prose)]


def letters_of(formula):
    """The letters of a formula: single ones, Greek ones as commands, and dt."""
    return {letter for letter in LETTER.findall(formula) if letter not in OPERATORS.split()}


def bare(symbol):
    """A symbol without its index."""
    return INDEX.sub("", symbol)


def test_the_page_has_the_table():
    """A row for each symbol: it, its meaning, its unit, where it comes first."""
    assert len(ROWS) > 50 and PAGE.startswith("# Symbols\n")
    assert len(ROWS) == len(re.findall(r"(?m)^\| \$", PAGE))


def test_no_symbol_stands_twice():
    """Not even with another index: that would be the same letter for another thing."""
    rows = [{bare(symbol) for symbol in symbols} for symbols, *_ in ROWS]
    for k, row in enumerate(rows):
        assert not row & set().union(*rows[:k]), row


@pytest.mark.parametrize("number", NOTEBOOKS)
def test_every_symbol_of_a_notebook_is_in_the_table(number):
    """And no letter of it comes in before the notebook that the table says."""
    known = {
        letter: first for symbols, _, first in reversed(ROWS) for each in symbols for letter in letters_of(bare(each))
    }
    for formula in formulas_of(NOTEBOOKS[number]):
        for letter in letters_of(formula):
            assert letter in known, f"{letter} in ${formula}$"
            assert known[letter] <= number, f"{letter} in ${formula}$ comes before {known[letter]}"


def test_a_symbol_is_found_where_the_table_says():
    """The notebook that it names has it in a formula."""
    for symbols, meaning, first in ROWS:
        formulas = formulas_of(NOTEBOOKS[first])
        for symbol in map(bare, symbols):
            letter = LETTER.fullmatch(symbol)
            found = any(symbol in (letters_of(each) if letter else each) for each in formulas)
            assert found, f"{symbol}, {meaning}: not in notebook {first}"


def test_letters_are_told_from_words_and_operators():
    """What the tests look for they must be able to see."""
    assert letters_of(WORDS.sub(" ", r"\dot\theta = 2 v \sin(\chi) / d \text{ if so}")) == {
        r"\theta",
        "v",
        r"\chi",
        "d",
    }
    assert [bare(each) for each in ("k_{mn}", "p_n", r"u_\perp", "p^*", "s_b")] == ["k", "p", "u", "p^*", "s"]
