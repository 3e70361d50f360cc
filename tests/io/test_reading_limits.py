"""Reading is linear in bytes and rows, takes no more memory than is stated, and can be stopped at any point."""

import os
import subprocess
import sys
import zlib
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import splap_editor
from splap_editor.core.progress import Cancelled
from splap_editor.engine.cache import HEAD, MAGIC
from splap_editor.io.content_hash import content_hash
from splap_editor.io.ply import PlyError, read_ply
from splap_editor.io.session_file import read_session_file
from splap_editor.io.splat_files import read_splats, write_splats
from splap_editor.io.thresholds import read_thresholds
from tests.campaign.seeds import ksplat_bytes, splat_records
from tests.reference.ply import compressed_bytes, ply_bytes, splat_columns

MEASURED = """
import sys
from pathlib import Path
import numpy as np
from splap_editor.io.ply import PlyError, read_ply
from splap_editor.io.list_rows import list_rows

# What is compiled is no part of a file.
list_rows(np.zeros(0, np.uint8), 0, *np.zeros((2, 0), np.int64), np.zeros(0, bool), False, np.zeros((1, 1), np.int64))

def peak():
    words = Path("/proc/self/status").read_text()
    return int(words.partition("VmHWM:")[2].split()[0]) * 1024

before = peak()
try:
    file = read_ply(sys.argv[1])
except PlyError as error:
    print(error, file=sys.stderr)
print(peak() - before)
"""
BASE = 256 << 20
N = 1 << 16
MOST_ROWS = 1 << 15
"""Between two moments at which reading can be stopped; a MiB of bytes otherwise."""


def repeated(columns, times, **options):
    """A file of many rows made of few."""
    data = ply_bytes(columns, **options)
    n = len(next(iter(columns.values())))
    end = data.index(b"end_header") + len(b"end_header\n")
    return data[:end].replace(b"vertex %d" % n, b"vertex %d" % (n * times)) + data[end:] * times


def plain(format_):
    return repeated(splat_columns(64, np.random.default_rng(0), n_rest=9), N // 64, format_=format_)


def few_digits():
    """Text that is short beside the numbers it stands for: doubles of one digit each."""
    columns = {name: np.ones(64, "i4") for name in splat_columns(1, np.random.default_rng(0), n_rest=45)}
    return repeated(columns, N // 64, format_="ascii").replace(b"property int", b"property double")


def faces(lengths):
    header, body = ply_bytes(splat_columns(4, np.random.default_rng(0))).split(b"end_header\n", 1)
    rows = b"".join(bytes([n]) + bytes(n) for n in lengths)
    times = (8 << 20) // len(rows)
    more = b"element face %d\nproperty list uchar char v\n" % (times * len(lengths))
    return header + more + b"end_header\n" + body + rows * times


def lists_among_the_columns():
    columns = splat_columns(64, np.random.default_rng(0))
    bones = [np.arange(i % 5, dtype="i2") for i in range(64)]
    return repeated({"x": columns.pop("x"), "bones": bones, **columns}, N // 64)


def packed():
    data = compressed_bytes(splat_columns(256, np.random.default_rng(0), n_rest=45))
    end = data.index(b"end_header\n") + len(b"end_header\n")
    times, chunk, row = N // 256, 18 * 4, 16 * 256
    header = data[:end].replace(b"chunk 1", b"chunk %d" % times).replace(b"vertex 256", b"vertex %d" % N)
    body = data[end:]
    parts = body[:chunk] * times + body[chunk : chunk + row] * times + body[chunk + row :] * times
    return header.replace(b"sh 256", b"sh %d" % N) + parts


CASES = {
    "binary": lambda: plain("binary_little_endian"),
    "big endian": lambda: plain("binary_big_endian"),
    "text": lambda: plain("ascii"),
    "text of few digits": few_digits,
    "packed": packed,
    "empty faces": lambda: faces([0]),
    "uneven faces": lambda: faces([3, 4, 3, 0, 7, 1]),
    "lists among the columns": lists_among_the_columns,
    "a tail of blank lines": lambda: (
        plain("ascii")[:100_000].replace(b"vertex 65536", b"vertex 64") + b"\n" * (16 << 20)
    ),
    "blank lines for rows": lambda: plain("ascii").partition(b"end_header\n")[0] + b"end_header\n" + b"\n" * (48 << 20),
}


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak is asked of Linux")
@pytest.mark.parametrize("case", CASES)
def test_memory_stays_within_eight_times_the_file(case, tmp_path):
    path = tmp_path / "scene.ply"
    path.write_bytes(CASES[case]())
    env = {**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, path], capture_output=True, text=True, env=env, check=True, timeout=120
    )
    assert int(done.stdout) <= 8 * path.stat().st_size + BASE // 4


def many_numbers():
    """Text of two bytes a number, as many of them as a document may hold."""
    rows = ",".join("1" for _ in range(3_900_000))
    return f'{{"version": 1, "handles": [{{"rows": [{rows}]}}]}}'.encode()


def session_of_many_numbers():
    start = b'{"format": "splap-session", "version": 1, "ply": {"path": "a.ply", "n_splats": 4}, "recipe": '
    return start + many_numbers() + b', "handles": [{"id": 1, "color": "#f2a93b"}]}'


def archive(write):
    data = BytesIO()
    write(data, Vth_pdf=np.zeros(N_NUMBERS, np.float32), Vth_opa=np.zeros(1, np.float32))
    return data.getvalue()


def cache_entry():
    data = archive(np.savez)
    return HEAD.pack(MAGIC, len(data), zlib.crc32(data)) + data


N_NUMBERS = 1 << 22
THRESHOLDS = f"""
from splap_editor.io.thresholds import read_thresholds
read = lambda path: read_thresholds(path, {N_NUMBERS})
"""
SESSION = "from splap_editor.io.session_file import read_session_file as read"
ENTRY = """
from splap_editor.engine.cache import StageCache
read = lambda path: StageCache(path.parent).load(path.stem, dict)
"""
# What makes and what reads each, and what that may take beside eight times the file.
OTHERS = {
    "recipe.json": (many_numbers, "from splap_editor.io.recipe import read_recipe as read", BASE),
    "session.splap": (
        session_of_many_numbers,
        "from splap_editor.io.session_file import read_session_file as read",
        BASE,
    ),
    "plain.npz": (
        lambda: archive(np.savez),
        THRESHOLDS,
        BASE // 4,
    ),
    "packed.npz": (
        lambda: archive(np.savez_compressed),
        THRESHOLDS,
        BASE // 4,
    ),
    "entry.npz": (
        cache_entry,
        ENTRY,
        BASE // 4,
    ),
}


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak is asked of Linux")
@pytest.mark.parametrize("name", OTHERS)
def test_memory_of_other_files_stays_within_eight_times_the_file(name, tmp_path):
    data, reader, beside = OTHERS[name]
    path = tmp_path / name
    path.write_bytes(data())
    program = f"""
import sys
from pathlib import Path
import numpy as np, zipfile
{reader}

def peak():
    return int(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0]) * 1024

before = peak()
held = read(Path(sys.argv[1]))
assert held is not None and not isinstance(held, str), held
print(peak() - before)
"""
    env = {**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", program, path], capture_output=True, text=True, env=env, check=True, timeout=120
    )
    assert int(done.stdout) <= 8 * path.stat().st_size + beside


MEASURED_SPLATS = """
import sys
from importlib import import_module
from pathlib import Path
from splap_editor.io.formats.table import FORMATS
from splap_editor.io.splat_files import read_splats

for row in FORMATS.values():
    if row.reads:
        import_module("splap_editor.io.formats." + row.reads.partition(":")[0])

def peak():
    return int(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0]) * 1024

before = peak()
file = read_splats(sys.argv[1])
print(peak() - before, file.table.body.nbytes)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak is asked of Linux")
@pytest.mark.parametrize("ending", ["spz", "sog", "glb", "splat", "ksplat"])
def test_memory_of_other_formats_stays_within_what_is_stated(ending, tmp_path):
    path = tmp_path / f"scene.{ending}"
    path.write_bytes(in_format(ending, 2 * N, tmp_path))
    env = {**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", MEASURED_SPLATS, path], capture_output=True, text=True, env=env, check=True, timeout=120
    )
    peak, table = map(int, done.stdout.split())
    # No multiple of the file bounds what packed numbers unpack to: twice the PLY that they make does.
    most = 2 * table + path.stat().st_size if ending in ("spz", "sog") else 8 * path.stat().st_size
    assert peak <= most + BASE // 16


def in_format(ending, n, folder):
    """The bytes of a file of so many splats."""
    rng = np.random.default_rng(0)
    if ending == "splat":
        return splat_records(n, rng).tobytes()
    if ending == "ksplat":
        return ksplat_bytes(n, rng)
    (folder / "plain.ply").write_bytes(repeated(splat_columns(256, rng, n_rest=45), n // 256))
    file = read_ply(folder / "plain.ply")
    write_splats(folder / f"packed.{ending}", file, file.splats)
    return (folder / f"packed.{ending}").read_bytes()


@pytest.mark.parametrize("case", ["binary", "big endian", "text", "packed", "uneven faces", "lists among the columns"])
def test_reading_asks_often_whether_it_shall_stop(case, tmp_path):
    path = tmp_path / "scene.ply"
    path.write_bytes(CASES[case]())
    shares = []
    file = read_ply(path, progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    # At least once for each MiB that is read, and again for each that is parsed.
    assert len(shares) >= path.stat().st_size >> 20
    if case in ("big endian", "packed"):
        # Once more for each block of rows that is converted, and looked over.
        assert sum(share > 0.9 for share in shares) >= 2 * (N // MOST_ROWS)
    for stop in (1, len(shares) // 2, len(shares) - 1):
        asked = []

        def cancel(share, asked=asked, stop=stop):
            asked.append(share)
            if len(asked) == stop:
                raise Cancelled

        with pytest.raises(Cancelled):
            read_ply(path, progress=cancel)
    assert file.table.n_rows in (4, N)


@pytest.mark.parametrize("ending", ["spz", "sog", "glb", "splat", "ksplat"])
def test_reading_other_formats_asks_often_whether_it_shall_stop(ending, tmp_path):
    path = tmp_path / f"scene.{ending}"
    path.write_bytes(in_format(ending, N, tmp_path))
    shares = []
    file = read_splats(path, progress=shares.append)
    assert file.splats.n_splats == N and file.format_name == {"glb": "gltf"}.get(ending, ending)
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert sum(share <= 0.2 for share in shares) >= path.stat().st_size >> 20
    assert sum(0.2 < share <= 0.9 for share in shares) >= N // MOST_ROWS

    for stop in range(0, len(shares), 3):
        asked = []

        def cancel(share, asked=asked, stop=stop):
            asked.append(share)
            if len(asked) > stop:
                raise Cancelled

        with pytest.raises(Cancelled):
            read_splats(path, progress=cancel)
        assert len(asked) == stop + 1, "it is not asked again"


def test_reading_what_lies_beside_asks_for_each_mebibyte_whether_it_shall_stop(tmp_path):
    (tmp_path / "beside.npz").write_bytes(archive(np.savez_compressed))
    shares = []
    assert not isinstance(read_thresholds(tmp_path / "beside.npz", N_NUMBERS, shares.append), str)
    assert shares == sorted(shares) and len(shares) >= 4 * N_NUMBERS >> 20
    with pytest.raises(Cancelled):
        read_thresholds(tmp_path / "beside.npz", N_NUMBERS, cancelled)


def test_reading_a_session_asks_for_each_mebibyte_whether_it_shall_stop(tmp_path):
    path = tmp_path / "work.splap"
    path.write_bytes(session_of_many_numbers())
    shares = []
    assert read_session_file(path, shares.append).ply.path == "a.ply"
    assert shares == sorted(shares) and shares[-1] == 1.0 and len(shares) >= path.stat().st_size >> 20
    with pytest.raises(Cancelled):
        read_session_file(path, cancelled)


def cancelled(share):
    raise Cancelled


def test_rows_without_columns_before_lists_are_refused_at_once(tmp_path):
    header, body = ply_bytes(splat_columns(4, np.random.default_rng(0))).split(b"element vertex", 1)
    more = b"element a 4000000000\nelement face 1\nproperty list uchar int v\n"
    (tmp_path / "scene.ply").write_bytes(header + more + b"element vertex" + body)
    with pytest.raises(PlyError, match="4,000,000,000 rows of an element 'a' without a column"):
        read_ply(tmp_path / "scene.ply")


def test_hashing_asks_for_each_mebibyte_whether_it_shall_stop(tmp_path):
    path = tmp_path / "scene.ply"
    path.write_bytes(bytes((5 << 20) + 3))
    shares = []
    whole = content_hash(path, shares.append)
    assert whole == content_hash(path) and len(shares) == 6 and shares == sorted(shares) and shares[-1] == 1.0

    def cancel(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        content_hash(path, cancel)
