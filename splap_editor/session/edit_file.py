"""The edit of a scene as a recipe, for ``splap-editor deform`` and for another file of the same splats."""

from dataclasses import replace
from pathlib import Path

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.removal import Finder as Find
from splap_editor.engine.edit import Edit
from splap_editor.engine.recipe_edit import edit_of, recipe_of, require_rows_fit, rows_of
from splap_editor.io.recipe import read_recipe, write_recipe
from splap_editor.session.scene import Scene


def write_edit(path: Path, scene: Scene) -> None:
    """Write the edit of a scene as a recipe that knows which file its rows are of."""
    write_recipe(path, replace(recipe_of(scene.edit), rows_of=rows_of(scene.file)))


def read_edit(path: Path, scene: Scene, find: Find | None = None, progress: Progress = no_progress) -> Edit:
    """Read a recipe as an edit of a scene; a ValueError says why it does not fit. ``find`` is as in `removal_of`."""
    recipe = read_recipe(path, part_of(progress, 0.0, 0.9))
    require_rows_fit(recipe, scene.file)
    return edit_of(recipe, scene.splats, find, part_of(progress, 0.9, 1.0))
