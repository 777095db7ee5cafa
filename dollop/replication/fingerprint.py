"""Fingerprints of the code that made a number: the same as long as nothing but prose is changed."""

import ast
import importlib.util
import sys
from functools import cache
from hashlib import sha256
from pathlib import Path

__all__ = ["fingerprint", "fingerprint_of_text", "modules_behind"]

PICTURES = {"dollop.plot", "dollop.lab.render"}
"""Modules that only draw: no number comes out of them, so that a figure may look otherwise and a study stay."""
DIGITS = 12
"""Of a fingerprint, hexadecimal: among a million versions two alike have a chance of one in 500."""


def fingerprint(*modules):
    """Fingerprint of modules and of all that they import of this library, directly or not.

    It is taken of the program that stands in the files, and of the files beside them that they
    name: of neither comments, docstrings and layout, nor of what a claim quotes and wants, which
    stands in the call of `claim` over an experiment. Other libraries are not in it: environment.txt
    has their versions. It is the same on any machine under the same version of Python.

    Parameters
    ----------
    *modules : str
        Their names, as in `sys.modules`.

    Returns
    -------
    str
        12 hexadecimal digits.

    Raises
    ------
    ValueError
        If a module has no source.

    Examples
    --------
    >>> fingerprint("dollop.pose") == fingerprint("dollop.pose") != fingerprint("dollop.lds")
    True
    """
    return fingerprint_of_text(*(f"{name} {_digest(_source(name))}" for name in modules_behind(*modules)))


def fingerprint_of_text(*texts):
    """Fingerprint of texts in their order.

    Parameters
    ----------
    *texts : str

    Returns
    -------
    str
        12 hexadecimal digits.
    """
    return sha256("\n".join(texts).encode()).hexdigest()[:DIGITS]


def modules_behind(*modules):
    """The modules themselves, and those of this library that they import, inside functions too.

    A package that makes its names out of its modules when they are asked for brings in all of them.
    What only draws is left out unless it is asked for itself.

    Parameters
    ----------
    *modules : str

    Returns
    -------
    list of str
        In alphabetical order.

    Raises
    ------
    ValueError
        If a module has no source.

    Examples
    --------
    >>> modules_behind("dollop.pose")
    ['dollop.pose']
    """
    found, left = set(), list(modules)
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            left += _imported(name, _source(name)) - PICTURES
    return sorted(found)


def _source(name):
    """The file of a module."""
    path = _file_of(name) or getattr(sys.modules.get(name), "__file__", None)
    if path is None or not Path(path).is_file():
        raise ValueError(f"{name} has no source to take a fingerprint of")
    return Path(path)


def _file_of(name):
    """The file of a module of this library, or None: without importing it."""
    place = Path(__file__).parents[1].parent.joinpath(*name.split("."))
    files = (place / "__init__.py", place.with_suffix(".py"))
    return next((path for path in files if name.split(".")[0] == "dollop" and path.is_file()), None)


@cache
def _tree(path):
    """The program in a file without its prose."""
    tree = ast.parse(path.read_bytes(), str(path))
    for node in ast.walk(tree):
        for field in ("body", "orelse", "finalbody"):
            if isinstance(statements := getattr(node, field, None), list):
                setattr(node, field, [each for each in statements if not _is_prose(each)])
        if isinstance(node, ast.FunctionDef):
            node.decorator_list = [each for each in node.decorator_list if not _is_claim(each)]
    return tree


def _is_prose(node):
    """Whether a statement is a text that stands for itself: of a module, a function or a constant."""
    return isinstance(node, ast.Expr) and _is_text(node.value)


def _is_text(node):
    """Whether an expression is a text that stands there."""
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _is_claim(node):
    """Whether a decorator is the call of `claim`."""
    return isinstance(node, ast.Call) and getattr(node.func, "id", None) == "claim"


@cache
def _digest(path):
    """Of a module's program, and of the files beside it that it names."""
    tree = _tree(path)
    digest = sha256(ast.unparse(tree).encode())
    for beside in sorted(_named_beside(tree, path)):
        digest.update(beside.read_bytes())
    return digest.hexdigest()


def _named_beside(tree, path):
    """Files beside a module whose names stand in it, such as "chosen.json"."""
    beside = {each.name: each for each in path.parent.iterdir() if each.suffix not in (".py", ".pyc")}
    named = {node.value for node in ast.walk(tree) if _is_text(node)}
    return {beside[name] for name in named & set(beside) if beside[name].is_file()}


@cache
def _imported(name, path):
    """Modules of this library that a module imports."""
    return set(_imports(name, path, _tree(path)))


def _imports(name, path, tree):
    """The same, one after the other."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if _file_of(alias.name))
        elif isinstance(node, ast.ImportFrom):
            module = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            inner = [f"{module}.{alias.name}" for alias in node.names]
            yield from (each if _file_of(each) else module for each in inner if _file_of(module))
    if any(isinstance(node, ast.FunctionDef) and node.name == "__getattr__" for node in tree.body):
        yield from (f"{name}.{each.stem}" for each in path.parent.glob("*.py") if each.stem != "__init__")
