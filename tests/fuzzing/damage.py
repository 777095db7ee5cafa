"""Damage to files that knows their formats: bytes, lines, words, trees of JSON and YAML, heads of binaries, gzip."""

import gzip
import io
import json
import re
import struct
import zlib
from functools import partial
from hashlib import sha256

NUMBERS = (
    b"nan", b"-nan", b"inf", b"-inf", b"Infinity", b"1e308", b"-1e308", b"1e309", b"1.7976931348623157e308",
    b"5e-324",
    b"1e155", b"1e17", b"1e10", b"1e9", b"1e6", b"1e-9", b"-1", b"-0", b"0", b"-0.0", b"1", b"2", b"3", b"1_0",
    b"1.9",
    b"0x10", b"0b1", b"0o7", b"1" + b"0" * 400, b"-" + b"9" * 400, b"9223372036854775807", b"9223372036854775808",
    b"4294967296", b"2147483648", b"-2147483649", b"65536", b"1e400", b"+1", b"1.", b".5", b"1e", b"1d5", b"1,5",
    b"1j", b"True", b"9" * 5000, b"0" * 5000 + b"1", b"0." + b"3" * 3000,
)  # fmt: skip
WORDS = (
    b"", b"abc", b"None", b"null", b"true", b"yes", b"NULL", b'""', b"''", b"\xff\xfe", b"\xc3\x28", b"\0",
    b"\xef\xbb\xbf",
    "\u0661\u0662".encode(), "\uff11".encode(), "\u2460".encode(), "\u00bd".encode(), "\u2028".encode(),
    b"x" * 100_000,
    b"%s%n", b"{0}", b"\x1b[31m", b"\r", b"\x0b", b"\x85", b"../../etc", b"a\nb", b"=1+1", b"\\", b"#", b";",
)  # fmt: skip
DEEP = 100_000


def pick(rng, things):
    """One of some things."""
    return things[int(rng.integers(len(things)))]


def place_in(rng, content):
    """A place in some content, its end as well."""
    return int(rng.integers(len(content) + 1))


def span_of(rng, content, most=None):
    """A stretch of some content: short ones are as likely as long ones."""
    longest = len(content) if most is None else min(most, len(content))
    length = int(longest ** rng.random()) if longest else 0
    start = int(rng.integers(len(content) - length + 1))
    return start, start + length


# ---- of any file


def flip(content, rng):
    """Some bits are others."""
    damaged = bytearray(content)
    for _ in range(int(rng.integers(1, 9)) if content else 0):
        damaged[int(rng.integers(len(damaged)))] ^= 1 << int(rng.integers(8))
    return bytes(damaged)


def overwrite(content, rng):
    """A few bytes are others."""
    start, end = span_of(rng, content, 16)
    return content[:start] + rng.bytes(end - start) + content[end:]


def insert(content, rng):
    """Bytes from nowhere."""
    at = place_in(rng, content)
    filling = pick(rng, (rng.bytes(8), b"\0" * 8, b"\xff" * 8, b"\n" * 4, b" " * 40, b"\n" * 5000, pick(rng, WORDS)))
    return content[:at] + filling + content[at:]


def delete(content, rng):
    """A stretch is missing."""
    start, end = span_of(rng, content)
    return content[:start] + content[end:]


def duplicate(content, rng):
    """A stretch is there twice, or many times."""
    start, end = span_of(rng, content, 4096)
    times = pick(rng, (2, 2, 2, 10, 100))
    return content[:start] + content[start:end] * times + content[end:]


def truncate(content, rng):
    """The end is missing."""
    return content[: place_in(rng, content)]


def emptied(content, rng):
    """Nothing, or as good as nothing."""
    return pick(rng, (b"", b"\n", b"\0" * 100, b" ", b"\xff" * 50, b"\n" * 200_000, b" " * 200_000, content[:1]))


def splice(content, rng, other):
    """The beginning of one file, and the end of another."""
    return content[: place_in(rng, content)] + other[place_in(rng, other) :]


BYTES = (flip, overwrite, insert, delete, duplicate, truncate)
BYTES = (*BYTES, *BYTES, emptied)

# ---- of text


def on_lines(content, rng, change):
    """Lines, changed as a list."""
    lines = content.split(b"\n")
    change(lines, rng)
    return b"\n".join(lines)


def _shuffle(lines, rng):
    rng.shuffle(lines)


def _swap(lines, rng):
    i, j = rng.integers(len(lines), size=2)
    lines[i], lines[j] = lines[j], lines[i]


def _double(lines, rng):
    i = int(rng.integers(len(lines)))
    lines[i:i] = [lines[i]] * pick(rng, (1, 1, 2, 50))


def _drop(lines, rng):
    del lines[int(rng.integers(len(lines)))]


def _join(lines, rng):
    i = int(rng.integers(len(lines)))
    lines[i : i + 2] = [b" ".join(lines[i : i + 2])]


LINES = tuple(partial(on_lines, change=each) for each in (_shuffle, _swap, _double, _drop, _join))


def words_of(content):
    """Where the words of a text are: what stands between spaces, commas, brackets and the like."""
    return [each.span() for each in re.finditer(rb"[^\s,\[\]{}:\"']+", content[:200_000])]


def replace_word(content, rng):
    """A word, or the same word in all places, is a hostile one."""
    found = words_of(content)
    if not found:
        return content
    start, end = pick(rng, found)
    new = pick(rng, NUMBERS if rng.random() < 0.75 else WORDS)
    if rng.random() < 0.1:
        return content.replace(content[start:end], new, 100)
    return content[:start] + new + content[end:]


def replace_words(content, rng):
    """Several words are hostile ones."""
    for _ in range(int(rng.integers(2, 6))):
        content = replace_word(content, rng)
    return content


def scale_number(content, rng):
    """A number is much larger, smaller, or of the other sign."""
    found = [
        span for span in words_of(content) if re.fullmatch(rb"[-+]?\d+(\.\d*)?(e[-+]?\d+)?", content[slice(*span)])
    ]
    if not found:
        return content
    start, end = pick(rng, found)
    factor = pick(rng, (1e308, 1e155, 1e17, 1e9, 1e6, 1e3, 10, 1.1, -1, 0.5, 1e-3, 1e-9, 1e-308, 0))
    value = float(content[start:end]) * factor
    new = repr(int(value) if b"." not in content[start:end] and abs(value) < 1e15 else value).encode()
    return content[:start] + new + content[end:]


def swap_words(content, rng):
    """Two words in each other's place."""
    found = words_of(content)
    if len(found) < 2:
        return content
    (a, b), (c, d) = sorted(found[int(i)] for i in rng.choice(len(found), 2, replace=False))
    return content[:a] + content[c:d] + content[b:c] + content[a:b] + content[d:]


TEXT = (replace_word, replace_word, replace_word, replace_words, scale_number, scale_number, swap_words, *LINES)

# ---- of trees


def nodes_of(tree, most=4000):
    """Where the values of a tree of dicts and lists are: (holder, key) of all, near the root first."""
    found, i = [], 0
    waiting = [tree]
    while i < len(waiting) and len(found) < most:
        holder = waiting[i]
        keys = holder if isinstance(holder, dict) else range(len(holder)) if isinstance(holder, list) else ()
        found += [(holder, key) for key in keys]
        waiting += [holder[key] for key in keys]
        i += 1
    return found


def nearly(rng, value):
    """A number that is a little different, or a list of numbers that are: such files may well be accepted."""
    if isinstance(value, bool) or not isinstance(value, int | float | list):
        return value
    if isinstance(value, list):
        change = pick(rng, (1e-7, 1e-3, 0.1, 3.0, 1e4))
        return [each + change if isinstance(each, float) else each for each in value]
    return pick(rng, (value + 1e-9, value * 1.001, value + 0.1, value + 1, value - 1, value * 2, value * 10, -value))


def hostile_value(rng, value, raw):
    """Something else in the place of a value of JSON; `raw` keeps what JSON's own writer would not write."""
    if isinstance(value, int) and abs(value) > 2**64:  # of a file that was damaged before
        value = 1
    kind = int(rng.integers(16))
    if kind > 11:
        return nearly(rng, value)
    if kind == 0:
        return raw(pick(rng, NUMBERS + (b"NaN", b"-Infinity", b"1" * 4301)))
    if kind == 1:
        return pick(
            rng, (None, True, False, [], {}, "", "abc", 0, -1, 1, 2, 0.5, 1e308, 1e17, 5e-324, [[]], [None], {"a": 1})
        )
    if kind == 2 and isinstance(value, list) and value:
        return pick(
            rng,
            (value[:-1], value[1:], value + value, value + value[-1:], value[::-1], [value], value[0], value[:1] * 3),
        )
    if kind == 3 and isinstance(value, list) and len(value) < 500:
        return value * 200
    if kind == 4:
        return [value]
    if kind == 5:
        return raw(b"[" * DEEP + b"]" * DEEP) if rng.random() < 0.1 else [[[[value]]]]
    if kind == 6 and isinstance(value, dict):
        return list(value.values())
    if kind == 7:
        return {"0": value}
    if isinstance(value, bool) or value is None:
        return pick(rng, (0, 1, "true", None, not value, [value]))
    if isinstance(value, int | float):
        return pick(rng, (
            -value, value * 1e308, value * 1e155, value * 1e9, value + 1, value - 1, value * 1.5, value + 1e-3,
            str(value),
            bool(value), raw(b"1" + b"0" * 400), raw(b"NaN"), 10**30, 2**31, 2**63, 2**64, -(2**63) - 1,
            value * 1000, 0, 1e9, 1e6,
        ))  # fmt: skip
    if isinstance(value, str):
        return pick(
            rng, (value + "x", value[:-1], value.upper(), "", value * 1000, "\ud800", "\x00", 5, [value], "a\nb")
        )
    if isinstance(value, list):
        numbers = [each for each in value if isinstance(each, int | float) and abs(each) < 2**64]
        if numbers and len(numbers) == len(value):
            factor = pick(rng, (1e308, 1e155, 1e9, -1, 0, 1e-308, 1.001, 100))
            return [each * factor for each in value]
        return [pick(rng, value)] * len(value) if value else [0]
    return list(value) if rng.random() < 0.5 else {}


def change_tree(content, rng):
    """A node or several of a JSON file is dropped, doubled, renamed or something else; other damage if it is none."""
    try:
        tree = json.loads(content)
    except (ValueError, RecursionError):
        return replace_word(content, rng)
    kept = []

    def raw(text):
        kept.append(text)
        return f"@@{len(kept) - 1}@@"

    holder = [tree]
    for _ in range(pick(rng, (1, 1, 1, 2, 4))):
        change_node(holder, rng, raw)
    try:
        text = json.dumps(holder[0]).encode()
    except (ValueError, RecursionError, OverflowError):
        return content
    return re.sub(rb'"@@(\d+)@@"', lambda found: kept[int(found[1])], text)


def change_node(holder, rng, raw):
    """Damage one node of the tree that a list holds alone."""
    found = nodes_of(holder)
    # Near the root there are few nodes and much meaning: half of the damage is there.
    place = int(rng.integers(len(found))) if rng.random() < 0.5 else int(len(found) ** rng.random()) - 1
    where, key = found[max(0, place)]
    action = rng.random()
    if action < 0.12 and where is not holder:
        del where[key]
    elif action < 0.16 and isinstance(where, dict):
        where[pick(rng, (key + "x", key.upper(), "", "unknown", "__class__"))] = where[key]
    elif action < 0.24 and where is not holder:
        other, there = pick(rng, found[1:])
        where[key] = json.loads(json.dumps(other[there]))  # a copy: no circles
    elif action < 0.28 and isinstance(where, list):
        rng.shuffle(where)
    else:
        where[key] = hostile_value(rng, where[key], raw)


# ---- of the study's tables


def change_row(content, rng):
    """A line of a table whose last column is a checksum is damaged, and the checksum is right again."""
    lines = content.split(b"\n")
    if not lines[0].endswith(b",check"):
        return pick(rng, TEXT)(content, rng)
    for _ in range(pick(rng, (1, 1, 3))):
        i = int(rng.integers(1, len(lines))) if len(lines) > 1 else 0
        text = pick(rng, (*TEXT, *BYTES))(lines[i].rpartition(b",")[0], rng).replace(b"\n", b" ")
        lines[i] = text + b"," + sha256(text).hexdigest()[:12].encode()
    return b"\n".join(lines)


# ---- of YAML

LAUGHS = b"a: &a [x,x,x,x,x,x,x,x,x]\n" + b"".join(
    b"%c: &%c [%s]\n" % (98 + i, 98 + i, b",".join([b"*%c" % (97 + i)] * 9)) for i in range(9)
)
YAML_VALUES = (
    b"!!bool foo", b"!!int abc", b"!!float x", b"!!python/object/apply:os.getcwd []", b"!!python/name:os.system",
    b"!!binary x",
    b"!!timestamp 1", b"!!set {a}", b"!!omap [a: 1]", b"!!null x", b"!!str 5", b"!<tag:x> 1", b"!x 1", b"&a [*a]",
    b"*a", b"&a 1",
    b"<<", b"[<<: 1]", b"2001-99-99", b"2001-01-01", b"2001-01-01 25:61:61", b"1:30", b"1:99:99.5", b"190:20:30",
    b"0o17", b"017", b"0b1",
    b"0x" + b"f" * 300, b".inf", b"-.inf", b".nan", b".Inf", b"1e3", b"1.0e+3", b"1_0", b"1__0.5", b"~", b"yes",
    b"no", b"on", b"off", b"true",
    b"|\n  text", b">\n  text", b"[1, 2", b"{a: b", b'"\\x41"', b'"\\U00110000"', b"'", b'"', b"%", b"@", b"`",
    b"- 1", b"? x", b"---", b"...",
    b"[" * 1000 + b"]" * 1000, b"[" * 3000, b"{" * 500, b"[[0, 0], 0, 0]", b"[0, 0]", b"[0, 0, 0, 0]", b"[0, 0, 1]",
    b"[.nan, 0, 0]", b"[1.0e+308, 0, 0]",
    b"[true, 0, 0]", b'["0", "0", "0"]', b"[1e3, 0, 0]", b"[1_0, 0, 0]", b"[0x10, 0, 0]", b"{0: 0}", b"{[a]: b}",
    b"{{}: 1}", b"{a: 1, a: 2}",
    b"/dev/zero", b"/dev/stdin", b"/proc/self/mem", b".", b"..", b"../x.pgm", b"x" * 5000 + b".pgm", b'"a\\0b.pgm"',
    b"map.yaml", b"http://x/y.pgm",
    b"trinary", b"scale", b"raw", b"Trinary", b"0.05", b"0", b"1", b"-1", b"1.0e-300", b"1.0e+300", b"1000000",
    b"0.00001", b"100",
)  # fmt: skip


def change_yaml(content, rng):
    """A value of a flat YAML is something that YAML can say and nobody meant; or the whole is a riddle."""
    action = rng.random()
    lines = content.split(b"\n")
    i = int(rng.integers(len(lines)))
    key, colon, _ = lines[i].partition(b":")
    if action < 0.8 and colon:
        value = pick(rng, YAML_VALUES if rng.random() < 0.6 else NUMBERS + WORDS)
        lines[i] = key + b": " + value
    elif action < 0.85:
        lines.insert(
            i,
            pick(
                rng,
                (
                    b"<<: {resolution: 5}",
                    b"<<: [1]",
                    b"<<: *a",
                    b"? [a]\n: b",
                    b"{}: 1",
                    b"---",
                    b"%YAML 9.9",
                    b"\t",
                    b"&a",
                ),
            ),
        )
    elif action < 0.9:
        lines[i:i] = [LAUGHS, key + b": *i"]
    elif action < 0.95:
        lines[i] = lines[i].replace(key, pick(rng, WORDS), 1)
    else:
        lines.append(b"more: " + pick(rng, YAML_VALUES))
    return b"\n".join(lines)


# ---- of binaries

EXTREMES = {
    1: (0, 1, 127, 128, 255),
    2: (0, 1, 0x7FFF, 0x8000, 0xFFFF),
    4: (0, 1, 2, 1000, 65536, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0xFFFFFFF0, 0x10000000, 0x7F800000, 0x7FC00000,
    0x7F7FFFFF, 0x00000001),
    8: (0, 1, 2**31, 2**32, 2**62, 2**63 - 1, 2**63, 2**64 - 1, 0x7FF0000000000000, 0x7FF8000000000000,
    0x7FE1CCF385EBC8A0),
}  # fmt: skip
"""Sizes, counts and numbers (inf, NaN, 1e308 among them) by the bytes that they take."""


def told_place(content, rng):
    """A place where something stands, and not one of many zeros."""
    for _ in range(20):
        at = int(rng.integers(len(content)))
        if content[at]:
            break
    return at


def extreme(content, rng):
    """Some bytes, which may be a size, a count or a number, are an extreme one."""
    size = pick(rng, (1, 2, 4, 4, 4, 8, 8))
    if len(content) < size:
        return content
    longest = len(content) - size + 1
    at = (
        told_place(content[:longest], rng) if rng.random() < 0.5 else int(longest ** rng.random()) - 1
    )  # heads tell most
    value = pick(rng, EXTREMES[size])
    return content[:at] + value.to_bytes(size, pick(rng, ("little", "little", "big"))) + content[at + size :]


def nudge(content, rng):
    """A byte that may be the lowest of a size or a count is one more, or one less."""
    if not content:
        return content
    at = told_place(content, rng)
    return content[:at] + bytes([(content[at] + pick(rng, (-1, 1, 16, -16))) % 256]) + content[at + 1 :]


BINARY = (extreme, extreme, extreme, nudge, *BYTES)


def change_png(content, rng):
    """A PNG whose parts are damaged, and whose checksums are right again: the damage is seen by who reads on."""
    parts, at = [], 8
    while at + 8 <= len(content):
        size, kind = struct.unpack_from(">I4s", content, at)
        parts.append((kind, content[at + 8 : at + 8 + size]))
        at += 12 + size
    if not parts:
        return flip(content, rng)
    k = int(rng.integers(len(parts)))
    kind, body = parts[k]
    action = rng.random()
    if kind == b"IHDR" and action < 0.8 and len(body) == 13:
        width, height, *rest = struct.unpack(">IIBBBBB", body)
        fields = [width, height, *rest]
        i = int(rng.integers(7))
        fields[i] = pick(
            rng, (0, 1, 1000, 30000, 65535, 2**31 - 1, 2**32 - 1) if i < 2 else (0, 1, 2, 3, 4, 6, 8, 16, 255)
        )
        body = struct.pack(">IIBBBBB", *fields)
    elif action < 0.4 and kind == b"IDAT":
        body = zlib.compress(
            pick(rng, (b"", b"\0" * 10, b"\0" * 10_000_000, pick(rng, BYTES)(safely_unpacked(body), rng)))
        )
    elif action < 0.6:
        parts.insert(
            k,
            (
                pick(rng, (b"tEXt", b"zTXt", b"iCCP", b"tRNS", b"PLTE", b"acTL", b"gAMA")),
                rng.bytes(int(rng.integers(40))),
            ),
        )
        kind, body = parts[k]
    else:
        body = pick(rng, BINARY)(body, rng)
    parts[k] = kind, body
    if rng.random() < 0.1:
        parts.insert(1, (b"zTXt", b"a\0\0" + zlib.compress(b"\0" * 50_000_000, 1)))
    made = [struct.pack(">I", len(b)) + k + b + struct.pack(">I", zlib.crc32(k + b)) for k, b in parts]
    return b"\x89PNG\r\n\x1a\n" + b"".join(made)


def safely_unpacked(content):
    """What zlib makes of it, or the same."""
    try:
        return zlib.decompressobj().decompress(content, 10**6)
    except zlib.error:
        return content


PGM_SIZES = b"0 1 -1 2 5 70000 1000000000 99999999999999999999 abc 1.5 1_0 # #\n".split()


def change_pgm(content, rng):
    """A PGM whose head, or kind, is another."""
    action = rng.random()
    if action < 0.25:
        kinds = (
            b"P1",
            b"P2",
            b"P3",
            b"P4",
            b"P6",
            b"P7",
            b"Pf",
            b"PF",
            b"P9",
            b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n",
            b"GIF89a",
            b"BM",
        )
        return pick(rng, kinds) + content[2:]
    words = content.split(None, 4)
    if action < 0.8 and len(words) == 5:
        words[int(rng.integers(1, 4))] = pick(rng, PGM_SIZES)
        return b"\n".join(words)
    return pick(rng, BINARY)(content, rng)


# ---- packed


def bomb(rng, head=b""):
    """Little that becomes much: zeros, spaces or newlines, many times 16 MiB, after a beginning."""
    filling = gzip.compress(pick(rng, (b"\0", b"\n", b" ", b"1 ")) * 2**23, 1, mtime=0)
    return gzip.compress(head, mtime=0) + filling * pick(rng, (1, 4, 20, 200))


def packed(content, rng, damage):
    """A gzipped file: what is in it is damaged, or the packing."""
    action = rng.random()
    if action < 0.55:
        try:
            inside = gzip.GzipFile(fileobj=io.BytesIO(content)).read(1_000_000)  # of a bomb the beginning
        except (OSError, EOFError, zlib.error):
            return pick(rng, BINARY)(content, rng)
        return gzip.compress(damage(inside, rng), 1, mtime=0)
    if action < 0.57:
        return bomb(rng, content[:100])
    if action < 0.62:
        return pick(
            rng,
            (content * 2, content + b"\0" * 9, gzip.compress(content, mtime=0), content + rng.bytes(9), content[:18]),
        )
    return pick(rng, BINARY)(content, rng)


# ---- by the name of a file


def one_of(*damages):
    """A damage of some, by chance."""
    return lambda content, rng: pick(rng, damages)(content, rng)


BY_SUFFIX = {
    ".log": one_of(*TEXT, *TEXT, *BYTES),
    ".csv": one_of(*TEXT, *TEXT, *BYTES, *[change_row] * 20),
    ".json": one_of(*[change_tree] * 30, *TEXT, *BYTES),
    ".yaml": one_of(*[change_yaml] * 20, *TEXT, *BYTES[:6]),
    ".map": one_of(*BINARY, replace_word),
    ".pgm": one_of(change_pgm, change_pgm, *BINARY),
    ".png": one_of(change_png, change_png, change_png, *BINARY),
}


def damage_for(name):
    """The damage that fits a file of this name."""
    if name.endswith(".gz"):
        return partial(packed, damage=damage_for(name.removesuffix(".gz")))
    return BY_SUFFIX.get("." + name.rsplit(".", 1)[-1], one_of(*BINARY))


def damaged(name, content, rng, other=None):
    """A file damaged once, twice or more; now and then spliced with another of its kind."""
    damage = damage_for(name)
    if other is not None and rng.random() < 0.05:
        return splice(content, rng, other)
    for _ in range(pick(rng, (1, 1, 1, 2, 3))):
        content = damage(content, rng)
        if len(content) > 3_000_000:
            break
    return content
