"""What is wrong with pages of HTML: links that lead nowhere, pictures without words, too many bytes."""

import re
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

LINKS = ("href", "src", "poster", "data")
"""Attributes that hold one address; srcset holds several."""
URL = re.compile(r"""url\(\s*["']?([^"')]+)["']?\s*\)""")
NO_WORDS = re.compile(r"\S*|<.*>|.*\.(png|jpe?g|gif|svg|webp|mp4)")
"""An alternative text that tells nobody anything: empty, a single word, a file's name, a thing of Python."""


class Page(HTMLParser):
    """What a page of HTML links to, the anchors that it offers, and its pictures without words."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors, self.wordless = [], set(), []
        self.style = False
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        """Note the links, the anchors and the words of one tag."""
        values = dict(attrs)
        self.style = tag == "style"
        self.links += [values[key] for key in LINKS if values.get(key)]
        self.links += [each.split()[0] for each in (values.get("srcset") or "").split(",") if each.strip()]
        self.links += URL.findall(values.get("style") or "")
        self.anchors |= {values.get("id"), values.get("name")}
        words = {"img": values.get("alt"), "video": values.get("aria-label")}.get(tag, "a film or a picture")
        if NO_WORDS.fullmatch((words or "").strip()):
            self.wordless.append(f"{tag} {(values.get('src') or '')[:60]} has the words {words!r}")

    def handle_data(self, data):
        """Note the links of a style sheet within the page."""
        self.links += URL.findall(data) if self.style else []

    def handle_endtag(self, tag):
        """A style sheet ends here, if it is one."""
        self.style = False


def faults(folder, largest):
    """Everything that is wrong with a folder of pages, a line for each.

    Parameters
    ----------
    folder : Path
    largest : float
        MB that all its files may have.

    Yields
    ------
    str
    """
    folder = folder.resolve()
    pages = {path: Page(path) for path in sorted(folder.rglob("*.html"))}
    for path, page in pages.items():
        name = path.relative_to(folder)
        yield from (f"dead link: {name}: {link}" for link in page.links if not leads_somewhere(link, path, pages))
        yield from (f"no words for a picture: {name}: {words}" for words in page.wordless)
    for path in sorted(folder.rglob("*.css")):
        for link in URL.findall(path.read_text(encoding="utf-8")):
            if not leads_somewhere(link, path, pages):
                yield f"dead link: {path.relative_to(folder)}: {link}"
    if size(folder) > largest:
        yield f"too large: {size(folder):.1f} MB, of which {largest} MB are allowed; the largest files:"
        yield from (f"  {bytes_of / 1e6:.1f} MB {name}" for bytes_of, name in largest_files(folder))


def leads_somewhere(link, path, pages):
    """Whether the file of a link exists and has its anchor; of addresses elsewhere the form is judged."""
    address = urlsplit(link)
    if address.scheme in ("http", "https"):
        return "." in address.netloc
    if address.scheme:
        return address.scheme in ("data", "mailto")
    target = (path.parent / unquote(address.path)).resolve() if address.path else path
    if not address.fragment:
        return target.is_file()
    return target in pages and unquote(address.fragment) in pages[target].anchors


def size(folder):
    """MB of all files in a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def largest_files(folder, count=5):
    """Bytes and names of the files that take most."""
    files = [(path.stat().st_size, str(path.relative_to(folder))) for path in folder.rglob("*") if path.is_file()]
    return sorted(files, reverse=True)[:count]
