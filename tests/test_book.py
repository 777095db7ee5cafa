"""The book: widgets become stills, pictures have words, every module has its page, and no link is dead."""

import base64
import io
import re
import runpy
import shutil
from types import SimpleNamespace

import pytest
from places import ROOT

import dollop

pytest.importorskip("sphinx", reason='the book needs the extra "book"')
nbformat = pytest.importorskip("nbformat", reason='the book needs the extra "book"')
Image = pytest.importorskip("PIL.Image")

with pytest.MonkeyPatch.context() as patch:
    patch.syspath_prepend(str(ROOT / "book"))
    executed, faults = (
        SimpleNamespace(**runpy.run_path(str(ROOT / "book" / f"{name}.py"))) for name in ("executed", "faults")
    )
    build = SimpleNamespace(**runpy.run_path(str(ROOT / "book" / "build.py")))

NOTEBOOKS = sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))
STATES = {
    "box": {"children": ["IPY_MODEL_slider", "IPY_MODEL_image"]},
    "slider": {"description": "x < y", "_options_labels": ["5 mm", "20 mm"], "index": 1},
    "image": {"format": "png"},
}


def png(colours=1):
    """A small picture in base64, of so many shades of grey."""
    picture = Image.new("RGB", (64, 64))
    picture.putdata([(n % colours,) * 3 for n in range(64 * 64)])
    with io.BytesIO() as stream:
        picture.save(stream, "PNG")
        return base64.b64encode(stream.getvalue()).decode()


VALUE = {"data": png() + "\n", "encoding": "base64", "path": ["value"]}
BUFFERS = {"image": {("value",): VALUE}}


def test_a_widget_becomes_a_picture_with_its_settings():
    """What a slider stands at is said, escaped, and its picture is embedded."""
    still = executed.still(STATES, BUFFERS, "box")
    assert "Here: x &lt; y = 20 mm." in still
    assert f'src="data:image/png;base64,{executed.lighter(png())}"' in still
    assert "controls stand here." in executed.still({"row": {}}, {}, "row")


def test_a_figure_that_can_be_clicked_into_is_its_own_still():
    """Of a live figure the picture stays, and nothing that would need a kernel."""
    data = {executed.WIDGET: {"model_id": "canvas"}, "image/png": "cGlj", "text/html": "<img>"}
    output = SimpleNamespace(data=data, get=lambda key, default: data)
    executed.freeze_widgets({"outputs": [output]}, client=None)
    assert output.data == {"image/png": "cGlj"}


def test_everything_inside_a_widget_is_found_in_order():
    """Children come after their parent."""
    assert list(executed.descendants(STATES, "box")) == ["box", "slider", "image"]


def test_what_is_no_control_has_no_setting():
    """A picture, a box or a button is not named among the settings."""
    assert executed.setting(STATES["image"]) is None
    assert executed.setting({"description": "kidnap the robot"}) is None
    assert executed.setting({"description": "x [m]", "value": 1.3}) == "x [m] = 1.3"


def test_every_formula_of_the_notebooks_can_be_drawn():
    """The converter to MathML knows every command that the notebooks use."""
    tex2mathml = pytest.importorskip("docutils.utils.math.latex2mathml").tex2mathml
    for path in NOTEBOOKS:
        for formula in re.findall(r"\$\$([^$]+)\$\$", prose_of(path)):
            assert "<math" in tex2mathml(formula, as_block=True), (path.name, formula)


def prose_of(path):
    """The Markdown of a notebook."""
    cells = nbformat.read(path, 4).cells
    return "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_notebook_names_what_the_api_explains(path):
    """The prose of each notebook has a public name at least once, and none that does not exist."""
    names = [found["first"] for found in build.NAME.finditer(prose_of(path))]
    assert set(names) & set(build.PUBLIC)
    assert all(hasattr(dollop, name) or f"dollop.{name}" in build.modules() for name in names)


def test_a_name_becomes_a_link_and_other_code_stays():
    """Public names to the module where they are defined, modules to their pages, others by their last name."""
    text = build.linked("`dollop.LDS.fit`, `tolerance`, `dollop.plot`, `dollop.lab.Pioneer` and `dollop map LOG`")
    linked = "{py:obj}`dollop.LDS.fit <dollop.lds.LDS.fit>`"
    assert (
        text == f"{linked}, `tolerance`, {{py:mod}}`dollop.plot`, {{py:obj}}`dollop.lab.Pioneer` and `dollop map LOG`"
    )


def test_a_name_within_a_link_stays():
    """It leads somewhere already."""
    assert build.linked("[`dollop.observe`](a.md)") == "[`dollop.observe`](a.md)"


def test_the_api_has_a_page_for_every_module_and_a_row_for_every_public_name(tmp_path):
    """Modules stand in the order of the paper, each with its first sentence."""
    build.write_api(tmp_path / "api")
    first = (tmp_path / "api" / "index.rst").read_text(encoding="utf-8")
    assert all(f"`dollop.{name} <" in first for name in build.PUBLIC)
    assert {path.stem for path in (tmp_path / "api").iterdir()} == {"index", *build.modules()}
    rows = re.findall(r"- :doc:`(\S+)`\n +- (.+)", first)
    assert dict(rows) == build.modules()
    order = [name for name, _ in rows]
    assert order.index("dollop.laser") < order.index("dollop.lds") < order.index("dollop.matching")
    assert order.index("dollop.matching") < order.index("dollop.cdhmm") < order.index("dollop.lab")


PAGES = {
    "index.html": """<a href="room/one.html#here">one</a> <a href="#top" id="top">up</a>
        <img alt="one dot" src="data:image/png;base64,"> <img alt="two cans" src="picture.png">""",
    "room/one.html": """<p id="here"><a href="../index.html?v=1">back</a>
        <a href="https://example.org/a#b">away</a></p>""",
}
DEAD = (
    *("room/two.html", "room/one.html#there", "#nowhere", "room", "picture.png#a"),
    *("https://", "ftp://example.org"),
)


@pytest.fixture
def small_book(tmp_path):
    """Two pages whose links all lead somewhere."""
    (tmp_path / "room").mkdir()
    (tmp_path / "picture.png").touch()
    for name, body in PAGES.items():
        (tmp_path / name).write_text(f"<html><body>{body}</body></html>")
    return tmp_path


def found(folder, largest=1):
    """The faults of a folder."""
    return list(faults.faults(folder, largest))


def test_links_that_lead_somewhere_pass(small_book):
    """Files, anchors here and on other pages, embedded pictures and addresses elsewhere."""
    assert found(small_book) == []


@pytest.mark.parametrize("link", DEAD)
def test_a_link_that_leads_nowhere_is_told_with_its_page(small_book, link):
    """A missing file or anchor, a folder, and an address that cannot be one."""
    (small_book / "bad.html").write_text(f'<a href="{link}">')
    assert found(small_book) == [f"dead link: bad.html: {link}"]


FILMS = (
    '<video src="gone.mp4" aria-label="a robot drives"></video>',
    '<video aria-label="a robot drives"><source src="gone.mp4" type="video/mp4"></video>',
    '<video src="film.mp4" poster="gone.mp4" aria-label="a robot drives"></video>',
    '<img alt="a robot drives" src="film.mp4" srcset="film.mp4 1x, gone.mp4 2x">',
    "<p style=\"background: url('gone.mp4')\">",
    "<style>p { background: url(gone.mp4) }</style>",
)


@pytest.mark.parametrize("tag", FILMS, ids=range(len(FILMS)))
def test_a_film_or_a_background_that_is_not_there_is_a_dead_link(small_book, tag):
    """Whatever holds the address: a film, its source, its first picture, a style."""
    (small_book / "film.mp4").touch()
    (small_book / "bad.html").write_text(tag)
    assert found(small_book) == ["dead link: bad.html: gone.mp4"]
    (small_book / "gone.mp4").touch()
    assert found(small_book) == []


def test_a_dead_link_of_a_style_sheet_is_told(small_book):
    """From where the style sheet lies; what is embedded is there."""
    (small_book / "room" / "a.css").write_text(
        'a { b: url("../picture.png") } c { d: url(data:,) } e { f: url(x.svg) }'
    )
    assert found(small_book) == ["dead link: room/a.css: x.svg"]


@pytest.mark.parametrize("alt", [None, "", "  ", "-", "../_images/a.png", "fig 1.png", "picture", "<Figure size 6x4>"])
def test_a_picture_without_words_is_told(small_book, alt):
    """Without an alternative text, or with one that is a file's name, a single word or a thing of Python."""
    words = "" if alt is None else f"alt='{alt}'"
    (small_book / "bad.html").write_text(f'<img {words} src="picture.png">')
    assert [fault.split(": ")[0] for fault in found(small_book)] == ["no words for a picture"]
    (small_book / "bad.html").write_text('<img alt="Two cans." src="picture.png">')
    assert found(small_book) == []


def test_a_film_without_words_is_told(small_book):
    """As a picture is; its words are its label."""
    (small_book / "bad.html").write_text('<video src="picture.png"></video>')
    assert len(found(small_book)) == 1


def test_a_book_that_is_too_large_is_told_with_what_makes_it_so(small_book):
    """The largest file first."""
    (small_book / "large.bin").write_bytes(bytes(2_000_000))
    first, second, *_ = found(small_book, largest=1)
    assert first.startswith("too large: 2.0 MB") and second == "  2.0 MB large.bin"
    assert found(small_book, largest=3) == [] and build.LARGEST == 40


def test_films_that_a_page_asks_for_are_brought_and_no_others(small_book, tmp_path):
    """From where the page would have them in the project; what is not there stays a dead link."""
    project = tmp_path / "project"
    (project / "films").mkdir(parents=True)
    for name in ("a.mp4", "b.mp4", "loop.webp", "notes.txt"):
        (project / "films" / name).touch()
    names = ("films/a.mp4", "films/loop.webp", "films/gone.mp4", "films/notes.txt", "https://b.org/films/b.mp4")
    tags = (f'<video aria-label="a film" src="{name}"></video>' for name in names)
    (small_book / "films.html").write_text("".join(tags))
    build.bring_films(small_book, project)
    assert {path.name for path in (small_book / "films").iterdir()} == {"a.mp4", "loop.webp"}
    assert found(small_book) == ["dead link: films.html: films/gone.mp4", "dead link: films.html: films/notes.txt"]


def test_the_source_of_a_module_becomes_its_page():
    """A reader of the book is led to the API, not to a file of code."""
    text = "[a](../dollop/lab/__init__.py) [b](dollop/lds.py)"
    linked = "[a](../api/dollop.lab.rst) [b](api/dollop.lds.rst)"
    assert build.CODE_LINK.sub(build.link_to_api, text) == linked


# ---- words for pictures


def markdown(text):
    """A cell of prose."""
    return nbformat.v4.new_markdown_cell(text)


def code(*outputs, **metadata):
    """A cell of code with these outputs."""
    shown = [nbformat.v4.new_output("display_data", data=data) for data in outputs]
    return nbformat.v4.new_code_cell("draw()", outputs=shown, metadata=metadata)


def words_of(*cells):
    """The alternative text of the last picture among these cells."""
    (n,) = (n for n, cell in enumerate(cells) if cell.cell_type == "code" and cell.outputs)
    return executed.alternative(list(cells), n)


PICTURE = {"image/png": png()}
READING = "*How to read it:* the *blue* line is [where](a.md) the `user` went, $x_n$, five times; boxes are the cans."


def test_a_picture_is_told_by_how_to_read_it():
    """Without marks, and beginning as a sentence does."""
    words = words_of(markdown("Draw."), code(PICTURE), markdown(f"{READING} More than that is not said of it."))
    assert words == "The blue line is where the user went, x_n, five times; boxes are the cans."


def test_without_how_to_read_it_a_picture_is_told_by_the_sentence_before_it():
    """After the name of its section; what is said of another cell's picture is not taken."""
    words = words_of(markdown("## Laps"), markdown("One. Then, two:"), code(PICTURE), code(), markdown(READING))
    assert words == "Laps: Then, two"


def test_a_long_reading_is_cut_where_one_can_breathe():
    """Whole sentences if they fit, else up to a comma; never longer than is listened to."""
    sentence = "The line is green, " * 30 + "and ends."
    words = words_of(code(PICTURE), markdown(f"*How to read it:* {sentence}"))
    assert len(words) <= executed.LONGEST and words.endswith("The line is green …")


def test_stills_and_films_get_the_same_words_and_keep_their_own():
    """HTML among the outputs: pictures get an alternative text, films a label, escaped."""
    still = '<img src="a"><img alt="" src="b"><img alt="Two cans" src="c"><video src="d"></video>'
    cell = code({"text/html": still})
    executed.describe(cell, 'Where "it" is')
    said = "Where &quot;it&quot; is"
    assert cell.outputs[0].data["text/html"] == (
        f'<img alt="{said}" src="a"><img alt="{said}" src="b"><img alt="Two cans" src="c">'
        f'<video aria-label="{said}" src="d"></video>'
    )
    assert cell.metadata["mystnb"]["image"]["alt"] == 'Where "it" is'


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_that_draws_has_words_to_be_told_by(path):
    """Whatever its output will be, there is prose for it, of some words and a length that is listened to."""
    cells = nbformat.read(path, 4).cells
    for n, cell in enumerate(cells):
        if cell.cell_type == "code" and n:
            words = executed.alternative(cells, n)
            assert len(words) <= executed.LONGEST and not faults.NO_WORDS.fullmatch(words), (path.name, cell.source)


def test_a_picture_becomes_smaller_and_stays_what_it_shows():
    """Of few colours it keeps every one; of many it has at most 256, none farther off than a shade or two."""
    for colours in (2, 200):
        (was, now) = (opened(picture) for picture in (png(colours), executed.lighter(png(colours))))
        assert was.convert("RGB").tobytes() == now.convert("RGB").tobytes()
    assert len(executed.lighter(png(200))) <= len(png(200))


def opened(picture):
    """A picture from base64."""
    return Image.open(io.BytesIO(base64.b64decode(picture)))


# ---- a small book


WIDE = f"""
| {" | ".join(f"column{n}" for n in range(9))} |
|{"---|" * 9}
| {" | ".join("`unbreakable_name`" for n in range(9))} |

    {"a very long command " * 9}

$$ {" + ".join(f"x_{{{n}}}" for n in range(60))} $$

<div id="buttons"></div>

    https://mybinder.org/v2/gh/OWNER/NAME/HEAD?urlpath=lab/tree/notebooks

    https://colab.research.google.com/github/OWNER/NAME/blob/main/notebooks/00_overview.ipynb
"""


@pytest.fixture(scope="module")
def laid_out(tmp_path_factory):
    """The pages of a book of one notebook, laid out as the book is."""
    folder = tmp_path_factory.mktemp("book")
    cells = [
        *(markdown("# One\n\nDraw."), code(PICTURE), markdown(READING.replace("[where](a.md)", "where"))),
        *(markdown("**Exercise.** Draw it again."), code({"text/plain": "the answer"}, tags=["hide-cell"])),
        *(markdown(WIDE), code({"text/html": f"<table class=dataframe><tr>{'<td>1,234.5</td>' * 30}</tr></table>"})),
    ]
    language = {"name": "python", "pygments_lexer": "ipython3"}
    notebook = nbformat.v4.new_notebook(cells=cells, metadata={"language_info": language})
    executed.make_readable(notebook, build.linked)
    (folder / "pages").mkdir()
    nbformat.write(notebook, folder / "pages" / "one.ipynb")
    (folder / "pages" / "index.md").write_text("# Book\n\n```{toctree}\none\n```\n", encoding="utf-8")
    assert build.sphinx(["-q", "-W", "-c", str(ROOT / "book"), str(folder / "pages"), str(folder / "html")]) == 0
    return folder / "html"


def test_a_notebooks_picture_has_its_words_on_the_page(laid_out):
    """The build finds no fault; without the words it would."""
    assert found(laid_out, largest=20) == []
    page = laid_out / "one.html"
    text = page.read_text(encoding="utf-8")
    assert 'alt="The blue line is where' in text
    (laid_out / "without.html").write_text(re.sub(r' alt="The[^"]*"', "", text), encoding="utf-8")
    (fault,) = found(laid_out, largest=20)
    (laid_out / "without.html").unlink()
    assert fault.startswith("no words for a picture: without.html")


def test_a_hidden_solution_is_folded_under_its_name(laid_out):
    """By the browser alone, without a script: an element that opens, closed at first, called Solution."""
    text = (laid_out / "one.html").read_text(encoding="utf-8")
    folded = re.search(r"<details class=\"[^\"]*hide[^\"]*\">(.+?)</details>", text, re.DOTALL)[1]
    assert re.search(r"<summary[^>]*>.*?Solution.*?</summary>", folded, re.DOTALL)
    assert "draw" in folded and "the answer" in folded and "Show code" not in text


def test_what_is_folded_is_unfolded_for_printing(laid_out):
    """The pages load the script and the style that do so."""
    text = (laid_out / "one.html").read_text(encoding="utf-8")
    assert "_static/book.js" in text and "beforeprint" in (laid_out / "_static" / "book.js").read_text()
    assert "details-content" in (laid_out / "_static" / "book.css").read_text()


def test_the_buttons_know_whose_book_it_is_and_nothing_that_is_not_so(laid_out):
    """Where the book is published its address is in the page; elsewhere there is none."""
    text = (laid_out / "one.html").read_text(encoding="utf-8")
    assert re.search(r'<script data-repository="[^"]*" src="_static/buttons.js', text)
    assert 'os.environ.get("GITHUB_REPOSITORY", "")' in (ROOT / "book" / "conf.py").read_text(encoding="utf-8")


# ---- in a browser


@pytest.fixture(scope="module")
def page(laid_out):
    """The notebook's page in Chromium, as wide as a phone."""
    driver = pytest.importorskip("selenium.webdriver", reason='opening pages needs the extra "dev"')
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not (chromium and shutil.which("chromedriver")):
        pytest.skip("opening pages needs Chromium and its driver: 'apt install chromium chromium-driver'")
    options = driver.ChromeOptions()
    options.binary_location = chromium
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu"):
        options.add_argument(argument)
    browser = driver.Chrome(options, driver.ChromeService(shutil.which("chromedriver")))
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get((laid_out / "one.html").as_uri())
    yield browser
    browser.quit()


def test_on_a_phone_nothing_is_wider_than_the_page(page):
    """Wide tables, code and formulas scroll in their own boxes."""
    wide = "return [...document.querySelectorAll(arguments[0])].filter(e => e.scrollWidth > e.clientWidth + 1).length"
    assert page.execute_script("return document.documentElement.scrollWidth") == 390
    assert page.execute_script(wide, ".table-wrapper, pre, div.math, .cell_output") >= 4


def test_a_solution_is_folded_on_the_screen_and_unfolded_on_paper(page):
    """On paper whatever was opened before, and without the navigation."""
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    heights = "return [...document.querySelectorAll('details.hide pre, .mobile-header')].map(e => e.offsetHeight)"
    header, *solution = page.execute_script(heights)
    seen = """
        const code = document.querySelector("details.hide pre");
        const { animationName, opacity } = getComputedStyle(document.querySelector("details.hide > :not(summary)"));
        return [code.checkVisibility({ contentVisibilityAuto: true }), animationName, opacity];"""
    as_printed = page.execute_script(seen)
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert header == 0 and min(solution) > 0 and as_printed == [True, "none", "1"]
    assert not page.execute_script("return document.querySelector('details.hide').open")


def test_a_button_leads_to_the_copy_that_somebody_names(page):
    """By owner and name or by its address; anything else is no copy, and the buttons lead nowhere."""
    addresses = """
        const field = document.querySelector("#buttons input");
        field.value = arguments[0];
        field.dispatchEvent(new Event("input"));
        return [...document.querySelectorAll("a.button")].map(each => each.getAttribute("href"));"""
    told = [
        "https://mybinder.org/v2/gh/me/a.fork/HEAD?urlpath=lab/tree/notebooks",
        "https://colab.research.google.com/github/me/a.fork/blob/main/notebooks/00_overview.ipynb",
    ]
    for name in (
        "me/a.fork",
        " https://github.com/me/a.fork ",
        "https://github.com/me/a.fork.git",
        "github.com/me/a.fork/",
    ):
        assert page.execute_script(addresses, name) == told
    for name in ("", "me", "https://example.org/me/a.fork", "me/a fork", "javascript:alert(1)"):
        assert page.execute_script(addresses, name) == [None, None]
