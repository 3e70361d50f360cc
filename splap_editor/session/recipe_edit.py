"""Recipes on disk and edits in memory, each made from the other."""

from splap_editor.core.splats import Splats
from splap_editor.io.recipe import Recipe
from splap_editor.session.edit import Edit


def recipe_of(edit: Edit) -> Recipe:
    """Write an edit as a recipe; disabled handles are left out, since they do nothing."""
    ...


def edit_of(recipe: Recipe, splats: Splats) -> Edit:
    """Make an edit of a recipe; the centre of a handle given by rows is the mean of its splats."""
    ...
