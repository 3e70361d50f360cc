"""What must hold of any input: it is refused in a sentence, or it is read and everything after works."""

import contextlib
import dataclasses
import io
import re
import shutil
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np

from splap_editor.cli import main as terminal
from splap_editor.core.adaptation.kernel_adaptation import adapted_splats
from splap_editor.core.deformer import UnconstrainedComponentError
from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.engine.bound_edit import bind
from splap_editor.engine.cache import HEAD, MAGIC, StageCache
from splap_editor.engine.edit import Edit, Handle
from splap_editor.engine.scene_info import scene_info
from splap_editor.engine.surface import surface_of
from splap_editor.io.formats.source import FormatError
from splap_editor.io.formats.table import FORMATS
from splap_editor.io.ply import PlyError, SplatFile, read_ply, write_ply
from splap_editor.io.recipe import RecipeError, read_recipe, write_recipe
from splap_editor.io.session_file import SessionFileError, read_session_file, write_session_file
from splap_editor.io.splat_files import losses_of_saving, read_splats, write_splats
from splap_editor.io.thresholds import Thresholds, read_thresholds
from tests.campaign.forks import is_forked
from tests.reference.ply import ply_bytes, splat_columns

SHIFT = np.array([1.0, 2.0, -1.0])
"""Whole, for columns of whole numbers."""

MOST_UNPACKED = 1 << 20
"""Bytes of a file that an archive gives out; sound ones have a few thousand."""

FOREIGN = re.compile(
    r"operands|broadcast|dtype|ndarray|axis \d|out of bounds|could not convert|invalid literal|to integer"
)
"""Words of libraries, which mean nothing to people."""


def is_deformed(number: int) -> bool:
    """Whether the input of a number is deformed too, if it is a PLY: one in 37."""
    return number % 37 == 0


def check_ply(path: Path, number: int) -> bool:
    """Whether a PLY is accepted; then it goes out as it came in, and comes back after an edit."""
    try:
        file = read_ply(path)
    except PlyError as error:
        assert path.name in str(error) and str(error).endswith((".", "?")), f"no sentence: {error}"
        return False
    out = path.with_name("out.ply")
    write_ply(out, file, file.splats)
    assert out.read_bytes() == path.read_bytes(), "an unedited file is not what it was"
    if file.layout.columns is not None:
        _check_edited(out, file)
    _check_written(path, file, number)
    scene_info(file)
    if is_deformed(number):
        _check_deformed(out, file)
    return True


def _check_edited(out: Path, file: SplatFile) -> None:
    splats = file.splats
    edited = dataclasses.replace(splats, means=np.asarray(splats.means, np.float64) + SHIFT)
    try:
        write_ply(out, file, edited)
    except PlyError as error:
        assert "cannot hold the result" in str(error), error
        return
    again = read_ply(out)
    assert again.splats.n_splats == splats.n_splats
    size = 1e-5 * (np.abs(np.asarray(splats.means, np.float64)).max() + 1.0)
    assert np.abs(again.splats.means - edited.means).max() <= size, "the edit is not in the file"


def _check_deformed(out: Path, file: SplatFile) -> None:
    center = np.asarray(file.splats.means[0], np.float64)
    handle = Handle(1, "one", "#ffffff", Region(center, 0.0, np.array([0])), Pose((0.5, 0.0, 0.0)))
    try:
        edit = Edit(handles=(handle,))
        kernels = bind(surface_of(file.splats, edit.graph), edit).pose().kernels
        write_ply(out, file, adapted_splats(file.splats, kernels))
    except (UnconstrainedComponentError, PlyError):
        return
    except ValueError as error:
        # What cannot be deformed says so.
        assert "splat" in str(error) or "handle" in str(error), error
        return
    read_ply(out)


def check_splats(path: Path, number: int) -> bool:
    """Whether a splat file of any format is accepted; then it goes out as another, and what went out is read."""
    try:
        file = read_splats(path)
    except (PlyError, FormatError) as error:
        assert path.name in str(error) and str(error).endswith((".", "?")), f"no sentence: {error}"
        return False
    _check_written(path, file, number)
    scene_info(file)
    return True


def check_folder(path: Path, number: int) -> bool:
    """Whether the files of a zip, put into a folder as far as it gives them out, are accepted as a splat file."""
    folder = path.with_name("folder")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    meta = folder / "meta.json"
    meta.write_bytes(path.read_bytes())
    # What a damaged archive raises is not tried here.
    with contextlib.suppress(Exception), zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            if info.file_size < MOST_UNPACKED and re.fullmatch(r"[\w.]+", info.filename):
                (folder / info.filename).write_bytes(archive.read(info))
    return check_splats(meta, number)


def _check_written(path: Path, file: SplatFile, number: int) -> None:
    """Edited, it is saved in a format, another for each number, and what was saved is read."""
    rows = [row for row in FORMATS.values() if row.can_be_written and not is_forked(row)]
    row = rows[number // 7 % len(rows)]
    out = path.with_name(f"out{row.suffixes[0]}")
    splats = file.splats
    if number // 5 % 2:
        splats = dataclasses.replace(splats, means=np.asarray(splats.means, np.float64) + SHIFT)
    losses_of_saving(file, row, splats)
    try:
        write_splats(out, file, splats)
    except (PlyError, FormatError) as error:
        assert "position" in str(error) or "cannot hold" in str(error), error
        return
    assert read_splats(out).splats.n_splats == splats.n_splats


def check_recipe(path: Path, number: int) -> bool:
    """Whether a recipe is accepted; then it is written and read as the same, and some are carried out."""
    names = read_recipe, write_recipe, RecipeError, "again.json", "name that cannot be written"
    if not _comes_back(path, *names, same=lambda held, again: held == again):
        return False
    if number // 5 % 3 == 0:
        carry_out(path, number)
    return True


def carry_out(recipe: Path, number: int) -> None:
    """Deform a small file by a recipe, as a terminal does: it ends with 0, or with 2 and a sentence."""
    scene, out = recipe.with_name("small.ply"), recipe.with_name("deformed.ply")
    if not scene.exists():
        scene.write_bytes(ply_bytes(splat_columns(60, np.random.default_rng(5), n_rest=9)))
    out.unlink(missing_ok=True)
    said = io.StringIO()
    words = ["deform", str(scene), "--recipe", str(recipe), "-o", str(out), "--quiet", "--no-cache"]
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
        code = terminal(words)
    if code == 0:
        read_ply(out)
        return
    last = said.getvalue().strip().splitlines()[-1]
    assert code == 2 and last.startswith("splap-editor: ") and not FOREIGN.search(last), f"no sentence: {last}"
    assert not out.exists(), "a refused recipe left a file"


def check_session(path: Path, number: int) -> bool:
    """Whether a session is accepted; then it is written and read as the same."""
    names = read_session_file, write_session_file, SessionFileError, "again.splap", "name that can be written"
    return _comes_back(path, *names, same=lambda held, again: held.recipe == again.recipe)


def _comes_back(path, read, write, refusal, name, unwritable, *, same) -> bool:
    """Whether a file is accepted; then what it holds is written and read as the same, unless it cannot be written."""
    try:
        held = read(path)
    except refusal as error:
        assert path.name in str(error), f"no sentence: {error}"
        return False
    again = path.with_name(name)
    try:
        write(again, held)
    except refusal as error:
        assert unwritable in str(error), error
        return True
    assert same(held, read(again))
    return True


def check_npz(path: Path, number: int) -> bool:
    """Whether an archive is accepted as thresholds."""
    found = read_thresholds(path, 12)
    assert isinstance(found, Thresholds) or path.name in found
    return isinstance(found, Thresholds)


def check_cache(path: Path, number: int) -> bool:
    """Whether a cache entry is taken: only if its check sum is right, which half of these are given."""
    data = path.read_bytes()
    cache = StageCache(path.with_name("cache"))
    cache.folder.mkdir(exist_ok=True)
    head = HEAD.pack(MAGIC, len(data), zlib.crc32(data)) if number // 5 % 2 else data[: HEAD.size]
    (cache.folder / "key.npz").write_bytes(head + data)
    try:
        found = cache.load("key", dict)
    except struct.error as error:
        raise AssertionError("an entry's bytes escaped as an error") from error
    assert (found is not None) == (cache.folder / "key.npz").exists()
    return found is not None
