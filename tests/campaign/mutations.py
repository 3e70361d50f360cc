"""Changes to a file: to what its format means, and to its bytes. Each is a function of the bytes and a generator."""

import gzip
import io
import json
import re
import zipfile
import zlib
from collections.abc import Callable

import numpy as np

Mutation = Callable[[bytes, np.random.Generator], bytes]

NUMBERS = (
    *("0", "-1", "1", "255", "256", "65536", "2147483647", "2147483648", "4294967295", "4000000000", "1e9", "1e39"),
    *("-1e300", "1e400", "nan", "inf", "-inf", "-0.0", "1e-320", "9" * 20, "9" * 5000, "", "0x10", "1_0", "१२"),
)
WORDS = (
    *("float", "double", "uchar", "char", "int", "uint", "short", "list", "property", "element", "vertex", "face"),
    *("chunk", "sh", "x", "rot_0", "opacity", "scale_0", "f_dc_0", "packed_position", "comment", "end_header"),
    *("ascii", "binary_little_endian", "binary_big_endian", "format", "ply", "<img src='/dev/zero'>", "\xa0", "\x00"),
)
VALUES = (
    *(None, True, False, 0, -1, 1, 2**31, 2**63, 10**300, 1e39, 1e300, -1e-300, float("nan"), float("inf"), "", "x"),
    *("../../etc/passwd", "\x00", "\ud800", [], {}, [[]], [0] * 3, [1e39] * 3, [0] * 4, [[0, 0]], {"a": {}}, "A" * 999),
)


def flip_bits(data: bytes, rng: np.random.Generator) -> bytes:
    """A few bits anywhere."""
    held = bytearray(data)
    for at in rng.integers(0, max(len(held), 1), int(rng.integers(1, 9))):
        if held:
            held[at] ^= 1 << int(rng.integers(8))
    return bytes(held)


def truncate(data: bytes, rng: np.random.Generator) -> bytes:
    """Cut short, near the end as often as anywhere."""
    return data[: int(rng.integers(0, len(data) + 1))] if rng.integers(2) else data[: -int(rng.integers(1, 40))]


def repeat_or_drop(data: bytes, rng: np.random.Generator) -> bytes:
    """A stretch twice, gone, or somewhere else."""
    lo, hi = sorted(rng.integers(0, len(data) + 1, 2).tolist())
    how = int(rng.integers(3))
    if how == 0:
        return data[:hi] + data[lo:]
    if how == 1:
        return data[:lo] + data[hi:]
    at = int(rng.integers(0, lo + 1))
    return data[:at] + data[lo:hi] + data[at:lo] + data[hi:]


def odd_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Bytes that parsers disagree about, put in somewhere."""
    odd = (b"\x00", b"\r", b"\n", b"\xc2\xa0", b"\x0b", b"\xff\xfe", b" ", b"\x7f\x80", b"\xef\xbb\xbf", bytes(64))
    at = int(rng.integers(0, len(data) + 1))
    return data[:at] + odd[int(rng.integers(len(odd)))] + data[at:]


def odd_floats(data: bytes, rng: np.random.Generator) -> bytes:
    """A number of the body becomes infinite, huge, tiny or none."""
    values = np.array([np.nan, np.inf, -np.inf, 3e38, -1e30, 1e-40, 0.0, 1e20], ">f4" if rng.integers(2) else "<f4")
    held = bytearray(data)
    start = held.find(b"end_header")
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(max(start, 0), max(len(held) - 4, start + 1, 1)))
        held[at : at + 4] = values[int(rng.integers(len(values)))].tobytes()
    return bytes(held)


def header_token(data: bytes, rng: np.random.Generator) -> bytes:
    """A word of the header becomes another, a number of it an odd one."""
    head, mark, body = data.partition(b"end_header")
    words = list(re.finditer(rb"[^\s]+", head))
    if not words:
        return data
    word = words[int(rng.integers(len(words)))]
    choices = NUMBERS if word[0].isdigit() and rng.integers(4) else WORDS
    new = choices[int(rng.integers(len(choices)))].encode()
    return head[: word.start()] + new + head[word.end() :] + mark + body


def header_lines(data: bytes, rng: np.random.Generator) -> bytes:
    """A line of the header goes, comes twice, or changes places with another."""
    head, mark, body = data.partition(b"end_header")
    lines = head.splitlines(keepends=True)
    if len(lines) < 2:
        return data
    i, j = rng.integers(0, len(lines), 2).tolist()
    how = int(rng.integers(4))
    if how == 0:
        del lines[i]
    elif how == 1:
        lines.insert(j, lines[i])
    elif how == 2:
        lines[i], lines[j] = lines[j], lines[i]
    else:
        lines[i] = lines[i] * int(rng.choice([2, 50, 5000]))
    return b"".join(lines) + mark + body


def text_token(data: bytes, rng: np.random.Generator) -> bytes:
    """A word anywhere becomes an odd number."""
    words = list(re.finditer(rb"[^\s,:\[\]{}]+", data))
    if not words:
        return data
    word = words[int(rng.integers(len(words)))]
    return data[: word.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))].encode() + data[word.end() :]


def json_value(data: bytes, rng: np.random.Generator) -> bytes:
    """A value somewhere in a document becomes another, a key is renamed, or goes."""
    try:
        held = json.loads(data)
    except (ValueError, RecursionError):
        return data
    places: list[tuple[dict | list, object]] = []
    waiting = [held]
    while waiting:
        value = waiting.pop()
        keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
        places += [(value, key) for key in keys]
        waiting += [value[key] for key in keys]
    if not places:
        return data
    where, key = places[int(rng.integers(len(places)))]
    how = int(rng.integers(5))
    if how == 0 and isinstance(where, dict):
        where[WORDS[int(rng.integers(len(WORDS)))]] = where.pop(key)
    elif how == 1:
        del where[key]
    else:
        where[key] = VALUES[int(rng.integers(len(VALUES)))]
    return json.dumps(held).encode()


def header_number(data: bytes, rng: np.random.Generator) -> bytes:
    """A number of one, two, four or eight bytes near the start, or after a mark within, becomes an odd one."""
    marks = [0, *(data.find(mark) for mark in MARKS if mark in data), *(at for at in (4096,) if at < len(data))]
    width = int(rng.choice([1, 2, 4, 4, 8]))
    at = marks[int(rng.integers(len(marks)))] + int(rng.integers(0, 64)) // min(width, 4) * min(width, 4)
    if at + width > len(data):
        return data
    old = int.from_bytes(data[at : at + width], "little")
    odd = (0, 1, old + 1, old - 1, 2 * old, old << 8, len(data), 0x7FFFFFFF, 0xFFFFFFFF, -1, 1 << 31, 1 << 63, 65535)
    new = odd[int(rng.integers(len(odd)))] % (1 << 8 * width)
    return data[:at] + new.to_bytes(width, "little") + data[at + width :]


def structure(data: bytes, rng: np.random.Generator) -> bytes:
    """What a file is made of, one layer in: of a gzip or a zip the contents, of JSON a value, of text a word."""
    if data[:2] == b"\x1f\x8b":
        change = (header_number, odd_floats, *BYTES)[int(rng.integers(2 + len(BYTES)))]
        try:
            return gzip.compress(change(gzip.decompress(data), rng), 1)
        except (OSError, EOFError, zlib.error):
            return data
    if data[:4] == b"PK\x03\x04":
        return _with_member(data, rng)
    if data[:4] == b"glTF":
        return chunk_value(data, rng)
    if data[:1] == b"{":
        return json_value(data, rng)
    if data[:6] == b"#usda ":
        return (text_token, header_token, header_lines)[int(rng.integers(3))](data, rng)
    return header_number(data, rng)


def chunk_value(data: bytes, rng: np.random.Generator) -> bytes:
    """A value in the JSON of a .glb becomes another, its lengths made right."""
    length = int.from_bytes(data[12:16], "little")
    changed = json_value(data[20 : 20 + length], rng)
    changed += b" " * (-len(changed) % 4)
    whole = data[:12] + len(changed).to_bytes(4, "little") + data[16:20] + changed + data[20 + length :]
    return whole[:8] + len(whole).to_bytes(4, "little") + whole[12:]


def _with_member(data: bytes, rng: np.random.Generator) -> bytes:
    """A zip with the contents of a member changed, or its name, or how it is packed, or one member more."""
    out = io.BytesIO()
    how = int(rng.integers(8))
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
            names = old.namelist()
            chosen = names[int(rng.integers(len(names)))]
            if how < 3 and any(name.endswith(".json") for name in names):
                chosen = next(name for name in names if name.endswith(".json"))
            for each in names:
                held, name, packing = old.read(each), each, zipfile.ZIP_STORED
                if each == chosen and how < 5:
                    held = structure(held, rng) if rng.integers(2) else BYTES[int(rng.integers(len(BYTES)))](held, rng)
                elif each == chosen and how == 5:
                    name = NAMES[int(rng.integers(len(NAMES)))]
                elif each == chosen and how == 6:
                    packing = (zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)[int(rng.integers(3))]
                    held += bytes(int(rng.choice([0, 1 << 20, 1 << 26], p=[0.6, 0.35, 0.05])))
                elif each == chosen:
                    new.writestr(zipfile.ZipInfo(each + "2"), held)
                new.writestr(zipfile.ZipInfo(name), held, packing)
    # A zip that was broken before stays as it is.
    except Exception:
        return data
    return out.getvalue()


NAMES = ("", "/etc/passwd", "../../meta.json", "meta.json", "C:\\x", "a/b", "\xa0", "x" * 300, "means_l.webp", "x.usda")
MARKS = (b"PK\x01\x02", b"PK\x05\x06", b"VP8L", b"VP8X", b"TOKENS", b"FIELDS", b"SPECS", b"BIN\0")
"""Where numbers stand together: in zips, pictures, stages and glTF."""

BYTES: tuple[Mutation, ...] = (flip_bits, truncate, repeat_or_drop, odd_bytes)
TEXT: tuple[Mutation, ...] = (header_token, header_token, header_lines, text_token, odd_floats, odd_floats, *BYTES)
DOCUMENT: tuple[Mutation, ...] = (json_value, json_value, json_value, text_token, *BYTES)
PACKED: tuple[Mutation, ...] = (structure, structure, structure, structure, header_number, odd_floats, *BYTES)


def chosen_of(pool: tuple[Mutation, ...], rng: np.random.Generator) -> list[tuple[Mutation, int]]:
    """What is done to a file, each with the seed of its own generator; now and then nothing."""
    count = int(rng.choice([0, 1, 1, 1, 2, 3, 5]))
    return [(pool[int(rng.integers(len(pool)))], int(rng.integers(2**32))) for _ in range(count)]


def mutated(data: bytes, mutations: list[tuple[Mutation, int]]) -> bytes:
    """Apply mutations one after another."""
    for mutation, seed in mutations:
        data = mutation(data, np.random.default_rng(seed))
    return data
