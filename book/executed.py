"""Notebooks executed, and made fit for a page: stills for widgets, words for pictures, small files.

What moves only with a running Python becomes the picture that it shows first.
"""

import html
import io
import re
import sys
from base64 import b64decode, b64encode

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from PIL import Image

WIDGET = "application/vnd.jupyter.widget-view+json"
PNG = "image/png"
TIMEOUT = 300  # s for one cell
QUIET = ["--IPKernelApp.log_level=ERROR"]
COLOURS = 256
READING = re.compile(r"\*How to read it:?\*:?")
LONGEST = 220
"""Characters of an alternative text: longer ones are not listened to."""
SHORTEST = 70
"""The same of a sentence that needs no second one beside it."""
WORDLESS = re.compile(r'<(?:(img)\b(?![^>]*\salt="[^"])|video\b(?![^>]*\saria-label="[^"]))')
"""Where the tag of a picture or a film begins that has no words."""


def execute(path):
    """One notebook, executed where it lies, with stills in place of its widgets.

    Parameters
    ----------
    path : Path

    Returns
    -------
    NotebookNode
        Without its outputs from where a cell asks for what is not installed, which is then told.
    """
    notebook = nbformat.read(path, as_version=4)
    place = {"metadata": {"path": str(path.parent)}}
    client = NotebookClient(notebook, timeout=TIMEOUT, resources=place, extra_arguments=QUIET)
    client.on_cell_executed = lambda cell, **_: freeze_widgets(cell, client)
    try:
        client.execute()
    except CellExecutionError as error:
        if error.ename != "ImportError":
            raise
        print(f"{path.name} is not executed: {error.evalue}", file=sys.stderr)
    notebook.metadata.pop("widgets", None)
    return notebook


def make_readable(notebook, link):
    """Give an executed notebook what its page needs.

    Parameters
    ----------
    notebook : NotebookNode
        Changed in place.
    link : callable
        Markdown in, the same with links to the API out.
    """
    for n, cell in enumerate(notebook.cells):
        if cell.cell_type == "code":
            describe(cell, alternative(notebook.cells, n))
            for output in cell.outputs:
                if PNG in output.get("data", {}):
                    output.data[PNG] = lighter(output.data[PNG])
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = link(cell.source)


# ---- widgets


def freeze_widgets(cell, client):
    """Replace a widget by a still while it shows what the cell made: later cells may move it."""
    for output in cell.get("outputs", []):
        view = output.get("data", {}).get(WIDGET)
        if view and PNG in output.data:  # a clickable figure brings its own still
            output.data = {PNG: output.data[PNG]}
        elif view:
            picture = still(client.widget_state, client.widget_buffers, view["model_id"])
            output.data = {"text/html": picture}


def still(states, buffers, root):
    """HTML of a widget: where its controls stand, and the picture that belongs to it."""
    parts = list(descendants(states, root))
    settings = html.escape(", ".join(filter(None, (setting(states[part]) for part in parts))))
    values = [buffers[part]["value",] for part in parts if ("value",) in buffers.get(part, {})]
    sources = (f"data:image/png;base64,{lighter(value['data'])}" for value in values)
    images = "".join(f'<img src="{source}">' for source in sources)
    words = "controls move this" if images else "controls stand here"
    here = f" Here: {settings}." if settings else ""
    return f'<p class="still">In the live notebook, {words}.{here}</p>{images}'


def descendants(states, name):
    """Names of a widget and of everything inside it, in order."""
    yield name
    for child in states[name].get("children", []):
        yield from descendants(states, child.removeprefix("IPY_MODEL_"))


def setting(state):
    """What a control is called and where it stands; nothing for what stands nowhere (a button).

    >>> setting({"description": "x [m]", "value": 1.3})
    'x [m] = 1.3'
    """
    value = state.get("value")
    if "_options_labels" in state:
        value = state["_options_labels"][state["index"]]
    if not state.get("description") or value is None:
        return None
    return f"{state['description']} = {value}"


# ---- words for pictures


def describe(cell, words):
    """Give the pictures and films among a cell's outputs an alternative text, where they have none."""
    cell.metadata.setdefault("mystnb", {}).setdefault("image", {}).setdefault("alt", words)
    for output in cell.outputs:
        text = output.get("data", {}).get("text/html")
        if text:
            output.data["text/html"] = with_words(text, html.escape(words))


def with_words(text, words):
    """HTML whose pictures and films without words of their own have these.

    >>> with_words('<img src="a.png"><video loop>', "A robot")
    '<img alt="A robot" src="a.png"><video aria-label="A robot" loop>'
    >>> with_words('<img alt="Two cans" src="a.png">', "A robot")
    '<img alt="Two cans" src="a.png">'
    """
    text = text.replace(' alt=""', "")
    return WORDLESS.sub(lambda found: f'{found[0]} {"alt" if found[1] else "aria-label"}="{words}"', text)


def alternative(cells, n):
    """What the picture of a cell shows, in the notebook's words.

    How to read it, if that is said before the next cell of code; else its section and the last sentence before it.

    Parameters
    ----------
    cells : list of NotebookNode
    n : int
        The cell with the picture.

    Returns
    -------
    str
    """
    for cell in cells[n + 1 :]:
        if cell.cell_type == "code":
            break
        if found := READING.search(cell.source):
            return first_words(plain(cell.source[found.end() :]))
    return first_words(f"{section(cells[:n])}: {last_words(cells[:n])}")


def section(cells):
    """The heading that these cells end under."""
    headings = re.findall(r"(?m)^#+ (.+)$", "\n".join(cell.source for cell in cells if cell.cell_type == "markdown"))
    return plain(headings[-1]) if headings else ""


def last_words(cells):
    """The last sentence before a picture."""
    text = plain("\n\n".join(cell.source for cell in cells if cell.cell_type == "markdown"))
    return (sentences(text) or [""])[-1]


def plain(text):
    """Markdown as somebody would read it aloud: the paragraphs, without headings, tables and marks.

    >>> plain("## Here" + chr(10) + "The *law* of [six](a.md) `LDS`, $\\\\tilde x = 2$.")
    'The law of six LDS, tilde x = 2.'
    """
    text = re.sub(r"(?s)```.*?```|<[^>]*>|\$\$.*?\$\$", " ", text)
    text = re.sub(r"(?m)^(#+ |\|).*$", " ", text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"\{[\w:]+\}`([^`<]*?)\s*(<[^`]*>)?`", r"\1", text)
    text = re.sub(r"\\\w+(?=\{)|\\(?=\w)|[*`$\\{}]|(?m:^(?:> |- |\d+\. ))", "", text)
    return " ".join(text.split())


def sentences(text):
    """The sentences of a text.

    >>> sentences("See Fig. 3. It is so.")
    ['See Fig. 3.', 'It is so.']
    """
    return re.findall(r"\S.*?[.!?:](?=\s+[A-Z(]|$)(?<!Fig\.)(?<!Sec\.)(?<!Eq\.)", text)


def first_words(text):
    """The beginning of a text, of a length that is listened to: whole sentences, or up to a comma.

    >>> first_words("one line for the whole walk. Close to the robot nine beams meet the user.")
    'One line for the whole walk. Close to the robot nine beams meet the user.'
    """
    told = ""
    for sentence in sentences(text) or [text]:
        if told and (len(told) >= SHORTEST or len(told) + len(sentence) > LONGEST):
            break
        told = f"{told} {sentence}".strip()
    if len(told) > LONGEST:
        told = re.match(rf".{{1,{LONGEST - 2}}}(?=[,;:] |$)|.{{1,{LONGEST - 2}}}(?= )", told)[0] + " …"
    return told[:1].upper() + told[1:].removesuffix(":")


# ---- small files


def lighter(picture):
    """A PNG with few colours, if that is smaller: drawings have few, and renderings little to lose.

    Parameters
    ----------
    picture : str
        In base64.

    Returns
    -------
    str
        In base64, on white.
    """
    data = b64decode(picture)
    image = Image.open(io.BytesIO(data)).convert("RGBA")
    image = Image.alpha_composite(Image.new("RGBA", image.size, "white"), image).convert("RGB")
    with io.BytesIO() as stream:
        image.quantize(COLOURS, dither=Image.Dither.NONE).save(stream, "PNG", optimize=True)
        return b64encode(min(data, stream.getvalue(), key=len)).decode()
