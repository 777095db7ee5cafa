"""The house itself: two houses with one door each, names that say what others may use, documents for all of them."""

import ast
import importlib
import inspect
import re
import subprocess
import sys
import textwrap

import pytest
from places import ROOT

MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted((ROOT / "dollop").rglob("*.py"))
}
TREES = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in MODULES.items()}
HOUSES = {
    "the library": [name for name in MODULES if not name.startswith("dollop.replication")],
    "the replication": [name for name in MODULES if name.startswith("dollop.replication")],
}
COMPREHENSIONS = ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp


def imported(tree):
    """(module, name) of everything that a module imports from the package, inside functions too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "dollop":
            yield from ((node.module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Import):
            names = (alias.name for alias in node.names)
            yield from ((name, None) for name in names if name.split(".")[0] == "dollop")


def rooms_below(name):
    """Modules of the package that a module imports: a package's door counts as the module behind it."""
    for module, imported_name in imported(TREES[name]):
        inner = f"{module}.{imported_name}"
        yield inner if inner in MODULES else module


def opened(name):
    """The module itself; the test is skipped where it needs an extra that is missing."""
    if name.startswith("dollop.lab"):
        pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    return importlib.import_module(name)


def public(name):
    """What a module offers: its __all__, else every name of its own without a leading underscore."""
    module = opened(name)
    if hasattr(module, "__all__"):
        return set(module.__all__)
    return {each for each in defined(TREES[name]) if not each.startswith("_")}


def defined(tree):
    """Names that a module defines at its top level."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign):
            places = (each for target in node.targets for each in ast.walk(target))
            yield from (place.id for place in places if isinstance(place, ast.Name))


# ---- two houses, one door each


def test_the_method_lies_flat_in_about_twenty_rooms():
    """`ls dollop` shows the paper's nouns, not its machinery."""
    assert len(list((ROOT / "dollop").glob("*.py"))) <= 22


def test_the_library_knows_nothing_of_the_replication():
    """Only the command line opens that door, by name and when it is asked to."""
    for name in HOUSES["the library"]:
        assert not any(module.startswith("dollop.replication") for module in rooms_below(name)), name
    naming = [name for name in HOUSES["the library"] if "dollop.replication" in MODULES[name].read_text()]
    assert naming == ["dollop.cli"]


def test_only_the_laboratory_knows_its_simulator():
    """PyBullet is imported in its engine, dollop.lab.engine, and nowhere else: whole or in part, or by its name."""
    assert [name for name, tree in TREES.items() if "pybullet" in brought_in(tree)] == ["dollop.lab.engine"]


def brought_in(tree):
    """Top names of all packages that a module imports, in functions too, and of those it imports by a string."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module.split(".")[0]
        elif isinstance(node, ast.Call) and "import" in ast.unparse(node.func):
            yield from (each.value for each in node.args if isinstance(each, ast.Constant))


def test_data_flow_one_way():
    """No room imports one that needs it: the rooms can be put on floors without a stair that runs back up."""
    floors = {}

    def floor(name, climbed=()):
        assert name not in climbed, f"a circle: {' -> '.join([*climbed, name])}"
        if name not in floors:
            below = {each for each in rooms_below(name) if each != name}
            floors[name] = 1 + max((floor(each, (*climbed, name)) for each in below), default=0)
        return floors[name]

    assert max(floor(name) for name in MODULES) <= 19


# ---- doors


@pytest.mark.parametrize("name", MODULES)
def test_others_take_only_what_is_offered(name):
    """What a module imports from another one stands in that one's __all__, or has no underscore where there is none."""
    for module, taken in imported(TREES[name]):
        if taken is not None and f"{module}.{taken}" not in MODULES:
            assert taken in public(module), f"{name} takes {taken} of {module}"


@pytest.mark.parametrize("name", HOUSES["the library"])
def test_what_is_offered_is_documented(name):
    """One sentence on one line for everything; parameters and results told of whatever can be called.

    In the replication a docstring is what the gallery or the table of claims prints.
    """
    module = opened(name)
    for each in sorted(public(name)):
        thing = getattr(module, each)
        if (inspect.isfunction(thing) or inspect.isclass(thing)) and thing.__module__ == name:
            check_documented(f"{name}.{each}", thing)
            for method, function in vars(thing).items() if inspect.isclass(thing) else ():
                function = getattr(function, "__func__", function)  # a class method's
                if not method.startswith("_") and inspect.isfunction(function):
                    check_documented(f"{name}.{each}.{method}", function)


def check_documented(name, thing):
    """Its docstring has a summary of one line, and sections for what its signature has."""
    text = inspect.getdoc(thing) or ""
    assert text, f"{name} has no docstring"
    assert len(text.split("\n")) == 1 or not text.split("\n")[1], f"{name}: the summary must be one line"
    if inspect.isfunction(thing):
        taken = [each for each in inspect.signature(thing).parameters if each not in ("self", "cls")]
        assert not taken or "Parameters\n---" in text, f"{name} does not say what {taken} are"
        source = ast.parse(textwrap.dedent(inspect.getsource(thing)))
        results = [node for node in ast.walk(source) if isinstance(node, ast.Return) and node.value]
        told = any(word in text for word in ("Returns\n---", "Yields\n---"))
        assert not results or told, f"{name} does not say what it returns"


def test_examples_show_properties():
    """The library's docstrings hold at least thirty examples; pytest runs them."""
    texts = (MODULES[name].read_text(encoding="utf-8") for name in HOUSES["the library"])
    assert sum(text.count("Examples\n") for text in texts) >= 30


# ---- how it reads


@pytest.mark.parametrize("house", HOUSES)
def test_lines_are_short(house):
    """At most one line in fifty is longer than a hundred characters."""
    lines = [line for name in HOUSES[house] for line in MODULES[name].read_text(encoding="utf-8").splitlines()]
    assert sum(len(line) > 100 for line in lines) <= 0.02 * len(lines)


def test_comprehensions_are_not_nested():
    """A comprehension within a comprehension is read twice: five may stay."""
    found = [
        f"{name}:{outer.lineno}"
        for name, tree in TREES.items()
        for outer in filter(lambda node: isinstance(node, COMPREHENSIONS), ast.walk(tree))
        if sum(isinstance(inner, COMPREHENSIONS) for inner in ast.walk(outer)) > 1
    ]
    assert len(found) <= 5, found


def test_no_expression_is_a_page():
    """What is longer than sixty lines is data, or several expressions."""
    for name, tree in TREES.items():
        longest = max((node for node in ast.walk(tree) if isinstance(node, ast.expr)), key=lines_of, default=None)
        assert longest is None or lines_of(longest) <= 60, f"{name}:{longest.lineno}"


def lines_of(node):
    """How many lines an expression takes."""
    return node.end_lineno - node.lineno + 1


# ---- the door is quick

SLOW = ("pandas", "matplotlib", "yaml", "PIL", "joblib", "pybullet", "rosbags", "scipy.stats", "scipy.optimize")


@pytest.mark.parametrize("code", ["import dollop", "import dollop.cli", "import dollop.cli as cli; cli._parser()"])
def test_only_what_is_needed_is_loaded(code):
    """Neither importing the library nor asking the command line for help loads what only some commands use."""
    told = subprocess.run(
        [sys.executable, "-c", f"import sys; {code}; print(*sys.modules)"], capture_output=True, text=True, check=True
    )
    assert not set(SLOW) & set(told.stdout.split())


def test_the_notation_table_names_what_is_there():
    """Every name in the table of dollop/__init__.py exists."""
    import dollop

    named = re.findall(r"^[IV].* `([\w.]+)`$", dollop.__doc__, re.MULTILINE)
    assert len(named) > 30
    for name in named:
        thing = dollop
        for part in name.split("."):
            module = f"{getattr(thing, '__name__', '')}.{part}"
            fields = getattr(thing, "__dataclass_fields__", {})
            thing = importlib.import_module(module) if module in MODULES else getattr(thing, part, fields.get(part))
        assert thing is not None, name
