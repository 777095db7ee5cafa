"""Bombs: little files that would take much time or memory to read, or start a program."""

import gzip
import io
import struct
import zlib

from damage import DEEP, LAUGHS
from kinds import small_map, written

MEGABYTES = 200
"""What refusing one may take."""


def png(width, height, bits=1):
    """A black picture of any size, whose rows are packed well."""
    rows = b"\0" * (100 * (1 + -(-width * bits // 8)))
    packer = zlib.compressobj(9, wbits=-15)
    packed = packer.compress(rows) + packer.flush(zlib.Z_FULL_FLUSH)  # stands by itself, so it can be said again
    check = (len(rows) * (height // 100) % 65521) << 16 | 1  # Adler-32 of zeros
    body = b"\x78\xda" + packed * (height // 100) + b"\x03\0" + struct.pack(">I", check)
    stream = io.BytesIO(b"")
    stream.write(b"\x89PNG\r\n\x1a\n")
    head = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    for kind, part in ((b"IHDR", head), (b"IDAT", body), (b"IEND", b"")):
        stream.write(struct.pack(">I", len(part)) + kind + part + struct.pack(">I", zlib.crc32(kind + part)))
    return stream.getvalue()


def map_with(picture=b"P5 1 1 255 \0", name="a.pgm", **keys):
    """A ROS map whose yaml and picture may be bombs."""
    content = {"image": name, "resolution": 0.05, "origin": "[0, 0, 0]"} | keys
    return {"a.yaml": "".join(f"{key}: {value}\n" for key, value in content.items()).encode(), name: picture}


def log_of(*places):
    """A FLASER log of two beams from some places."""
    lines = (f"FLASER 2 1.0 1.0 {p} {p} 0 {p} {p} 0 {k} host {k}" for k, p in enumerate(places))
    return "\n".join(lines).encode()


def bombs():
    """All bombs, {name: (kind of file, files)}."""
    carmen = written("a.map", small_map().save)["a.map"]
    laughs = [b"a: &a [x,x,x,x,x,x,x,x,x]"] + [
        b"a%d: &a%d [%s]" % (i, i, b",".join([b"*a%d" % (i - 1)] * 9)) for i in range(1, 9)
    ]
    laughs[1] = laughs[1].replace(b"*a0", b"*a")
    zeros = gzip.compress(b"\0" * 2**24, 9, mtime=0)
    return {
        "aliases in a yaml": ("ros map, pgm", {"a.yaml": b"\n".join(laughs) + b"\nimage: *a8\n"}),
        "aliases as the whole": ("ros map, pgm", {"a.yaml": LAUGHS + b"resolution: *i\norigin: *i\n"}),
        "aliases as a key": ("ros map, pgm", {"a.yaml": LAUGHS + b"? *i\n: 1\n"}),
        "aliases as the picture's name": ("ros map, pgm", {"a.yaml": LAUGHS + b"image: *i\n"}),
        "deep yaml": ("ros map, pgm", {"a.yaml": b"[" * DEEP}),
        "deep json": ("task 1", {"a.json": b"[" * DEEP + b"]" * DEEP}),
        "deep scene": ("scene", {"a.json": b'{"a":' * DEEP + b"1" + b"}" * DEEP}),
        "a large picture": ("ros map, png", map_with(png(30_000, 30_000), "a.png")),
        "a larger picture": ("ros map, png", map_with(png(100_000, 50_000), "a.png")),
        "a picture of its head alone": ("ros map, pgm", map_with(b"P5 100000 100000 255\n")),
        "a program of PostScript": ("ros map, pgm",
        map_with(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n")),
        "newlines before a map": ("carmen map", {"a.map": b"\n" * 204_000}),
        "comments before a map": ("carmen map", {"a.map": b"#\n" * 102_000 + carmen}),
        "a map of many cells": ("carmen map", {"a.map": carmen[:carmen.index(b"GRIDMAP") + 10] + struct.pack("<iif",
        2**30, 2**30, 0.1)}),
        "a log of two places far apart": ("carmen log", {"a.log": log_of(0, 1000)}),
        "a log of places in a row": ("carmen log", {"a.log": log_of(*range(0, 2000, 100))}),
        "newlines in a log": ("carmen log", {"a.log": b"\n" * 200_000}),
        "one long line": ("carmen log", {"a.log": b"FLASER " + b"1 " * 2_000_000}),
        "packed zeros": ("carmen log, packed", {"a.log.gz": zeros * 128}),
        "packed newlines": ("carmen log, packed", {"a.log.gz": gzip.compress(b"\n" * 2**24, 9, mtime=0) * 128}),
        "packed maps": ("carmen map", {"a.map": zeros * 128}),
        "packed maps by their name": ("carmen map, packed", {"a.map.gz": gzip.compress(carmen, mtime=0) + zeros * 128}),
        "a packed task": ("task 1", {"a.json": gzip.compress(b" " * 2**24, 9, mtime=0) * 128}),
        "a long number": ("task 1", {"a.json": b'{"format": "dollop task", "version": 1' + b"0" * 5_000_000 + b"}"}),
        "many rows": ("worlds", {"worlds.csv": b"\n" * 5_000_000}),
    }  # fmt: skip
