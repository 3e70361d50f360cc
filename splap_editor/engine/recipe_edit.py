"""Edits as plain values, as a recipe holds them, and edits of a scene, each made from the other."""

from collections.abc import Iterator

import numpy as np

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.removal import Finder as Find
from splap_editor.core.removal import PickedRows
from splap_editor.core.splats.splats import Splats
from splap_editor.core.timeline import Timeline
from splap_editor.engine.edit import HANDLE_COLORS, Edit, Handle, Pin
from splap_editor.engine.grading import Grading, grading_of
from splap_editor.engine.removal import Removal, removal_of
from splap_editor.io import plain_edit as plain
from splap_editor.io.content_hash import content_hash, has_content
from splap_editor.io.formats.table import FORMATS
from splap_editor.io.plain_edit import Vector
from splap_editor.io.recipe import RecipeError
from splap_editor.io.splat_files import SplatFile


def recipe_of(edit: Edit, *, with_disabled: bool = False) -> plain.Edit:
    """Write an edit as a recipe; disabled handles are left out unless wanted, since they do nothing."""
    return plain.Edit(
        handles=tuple(_handle_spec(handle) for handle in (edit.handles if with_disabled else edit.active_handles)),
        pins=tuple(
            plain.Pin(*_place(pin.region), name="" if pin.name == _pin_name(number) else pin.name)
            for number, pin in enumerate(edit.pins, start=1)
        ),
        method=edit.method,
        options=edit.options,
        remove=edit.removal.steps,
        grade=edit.grading.steps,
        place=edit.place,
        camera=edit.timeline.camera_keys,
    )


def edit_of(recipe: plain.Edit, splats: Splats, find: Find | None = None, progress: Progress = no_progress) -> Edit:
    """Make an edit of a recipe.

    The centre of a handle given by rows alone is the mean of its splats. ``find`` is as in `removal_of`; ``progress``
    is told the share of handles and pins that have their splats, and may cancel.

    Raises
    ------
    RecipeError
        A row is not in the file, nothing says which splats a handle or a pin is of, or there is no such quantity to
        remove or grade splats by.
    """
    regions = _regions(recipe, splats, progress)
    removal = _removal(recipe, splats, find)
    handles = tuple(
        Handle(
            number,
            spec.name,
            HANDLE_COLORS[(number - 1) % len(HANDLE_COLORS)],
            next(regions),
            spec.pose,
            cage_radius=spec.cage_radius,
            frees=spec.frees,
        )
        for number, spec in enumerate(recipe.handles, start=1)
    )
    return Edit(
        handles=handles,
        pins=tuple(
            Pin(number, spec.name or _pin_name(number), next(regions), spec.radius)
            for number, spec in enumerate(recipe.pins, start=1)
        ),
        method=recipe.method,
        options=recipe.options,
        removal=removal,
        grading=_grading(recipe, splats, removal, find),
        place=recipe.place,
        timeline=Timeline(camera_keys=recipe.camera),
    )


def _pin_name(number: int) -> str:
    """Name of a pin that a recipe gives none."""
    return f"Pin {number}"


def require_rows_fit(recipe: plain.Edit, file: SplatFile) -> None:
    """Refuse a recipe that names rows of another file, where a format has an order of rows of its own.

    Raises
    ------
    RecipeError
        The recipe names rows, and it is not known that this file's are meant.
    """
    graph = recipe.options[GraphOptions]
    regions: list[plain.Handle | plain.Pin] = [*recipe.handles, *recipe.pins]
    names_rows = [spec.rows is not None for spec in regions] + [bool(graph.cut or graph.add)]
    picked = [*(step.picked for step in recipe.remove), *(step.picked for step in recipe.grade)]
    names_rows += [isinstance(each, PickedRows) for each in picked]
    if not any(names_rows) or not (recipe.rows_of or FORMATS[file.format_name].reorders):
        return
    if not has_content(file.path, recipe.rows_of):
        raise RecipeError(
            f"the edit names rows, and those of {file.path.name} stand in another order than in the file it was made "
            "for: use that file, or give handles and pins by center and radius"
        )


def rows_of(file: SplatFile) -> str:
    """What a recipe made for a file says as ``rows_of``."""
    return content_hash(file.path) if FORMATS[file.format_name].reorders else ""


def _removal(recipe: plain.Edit, splats: Splats, find: Find | None) -> Removal:
    try:
        return removal_of(recipe.remove, splats, find)
    except ValueError as error:
        raise RecipeError(str(error)) from error


def _grading(recipe: plain.Edit, splats: Splats, removal: Removal, find: Find | None) -> Grading:
    try:
        return grading_of(recipe.grade, splats, removal.mask, find)
    except ValueError as error:
        raise RecipeError(str(error)) from error


def _handle_spec(handle: Handle) -> plain.Handle:
    center, radius, rows = _place(handle.region)
    return plain.Handle(
        handle.name,
        center,
        radius,
        rows,
        handle.pose.translate,
        handle.pose.rotate,
        handle.pose.scale,
        handle.cage_radius,
        handle.frees,
    )


def _place(region: Region) -> tuple[Vector, float | None, tuple[int, ...] | None]:
    center = tuple(np.asarray(region.center, np.float64).tolist())
    if region.rows is None:
        return center, float(region.radius), None
    return center, None, tuple(np.asarray(region.rows).tolist())


def _regions(recipe: plain.Edit, splats: Splats, progress: Progress) -> Iterator[Region]:
    """Regions of all handles, and after them of all pins."""
    named: list[tuple[plain.Handle | plain.Pin, str]] = [(spec, f"handle {spec.name!r}") for spec in recipe.handles]
    named += [(pin, f"pin {number}") for number, pin in enumerate(recipe.pins, start=1)]
    for done, (spec, name) in enumerate(named):
        progress(done / len(named))
        yield _region(spec, splats, name)


def _region(spec: plain.Handle | plain.Pin, splats: Splats, name: str) -> Region:
    if spec.rows is None:
        if spec.center is None or spec.radius is None:
            raise RecipeError(f"{name} needs a center and a radius, or the rows of its splats")
        return Region(np.array(spec.center, np.float64), spec.radius)
    rows = np.array(spec.rows, np.int64)
    if rows.max(initial=-1) >= splats.n_splats:
        raise RecipeError(
            f"{name} names row {rows.max()}, but the file has rows 0 to {splats.n_splats - 1}: "
            "the recipe was made for another file"
        )
    center = np.asarray(splats.means[rows], np.float64).mean(axis=0) if spec.center is None else np.array(spec.center)
    return Region(center, 0.0, rows)
