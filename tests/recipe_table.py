"""The README's table of recipe keys, made from the groups of options.

``python -m tests.recipe_table`` writes it into the README.
"""

from splap_editor.core.camera_path import CameraPose
from splap_editor.core.deformers import DEFORMERS, method_titles
from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.options import Option, ShareOfSize, options_of
from splap_editor.core.presets import PRESETS
from splap_editor.core.reach_options import CageOptions
from splap_editor.io.recipe import recipe_groups
from splap_editor.io.recipe_removal import PICKED_KINDS
from splap_editor.io.recipe_schema import FREES
from tests.keys_table import README, with_block

START, END = "<!-- recipe: python -m tests.recipe_table -->\n", "<!-- end of recipe -->\n"


def recipe_table() -> str:
    """Markdown: a line for each key of a recipe, options with choices, bounds and default."""
    methods = " or ".join(f'`"{method}"` ({title.lower()})' for method, title in method_titles().items())
    rows = [("method", f"{methods}; the first by default")]
    presets = _choices({name: preset.sentence for name, preset in PRESETS.items()})
    rows += [("preset", f"{presets}; what the other keys say counts more")]
    cage = " ".join(_told(known) for known in options_of(CageOptions).values())
    place = "`name`, `center` and `radius`, or file `rows`"
    pose = "`translate`, `rotate` (w, x, y, z), `scale` about the center"
    frees = f"`frees`: {FREES} True by default."
    rows += [("handles", f"{place}; {pose}; `cage_radius`: {cage} {frees}"), ("pins", f"{place}: they stay")]
    for key, group in recipe_groups():
        only = [row.method for row in DEFORMERS if row.options is group]
        said = f" (`{only[0]}`)" if only else ""
        for name, known in options_of(group).items():
            rows.append((f"{key}.{name}" if key else name, f"{_told(known)}{said}"))
    kinds = " · ".join(f"`{kind.key}` ({', '.join(f'`{key}`' for key in kind.properties)})" for kind in PICKED_KINDS)
    rows += [
        (
            "remove",
            "Splats left out of everything, first of all and in the file's coordinates: an object, or a list of them "
            f"taken in order. Each has one of `rows` · {kinds}; `outside`: all others are meant; `restore`: they come "
            "back",
        ),
        (
            "grade",
            "Colour grades, each over those before: an object, or a list of them. Each is of what `rows` or one of the "
            "keys of `remove` picks at rest, or of all splats; `outside`: of all others. "
            + " ".join(f"`{name}`: {_told(known)}" for name, known in options_of(GradeOptions).items()),
        ),
        ("place", "`center`, `translate`, `rotate` (w, x, y, z), `scale`: all of it as one body, last of all"),
        (
            "camera",
            "Where the camera stands at frames of a video: a list of `frame`, `position`, `target`, `up` (z by "
            f"default), `angle` (field of view in degrees, {CameraPose.angle:g} by default), `parallel`; smooth in "
            "between",
        ),
    ]
    return "\n".join(["| key | meaning |", "|---|---|", *(f"| `{key}` | {told} |" for key, told in rows)]) + "\n"


def _told(known: Option) -> str:
    """What an option does, what it may be and what it is without."""
    if known.kind == "choice":
        return (
            f"{known.sentence} {_choices({name: row.sentence for name, row in known.choices.items()}, known.default)}"
        )
    usual = known.default
    if known.strokes is not None:
        own = "".join(f', "{name}": {_usual(each)}' for name, each in options_of(known.strokes).items())
        return f'{known.sentence} `[{{"a": [[x, y, z], …], "b": […]{own}}}, …]`'
    if known.kind == "pairs":
        return f"{known.sentence} `[[row, row], …]`"
    if isinstance(usual, ShareOfSize):
        return f"{known.sentence} By default {usual.share:g} s."
    return f"{known.sentence} {known.wanted[0].upper()}{known.wanted[1:]}; {usual:g} by default."


def _usual(known: Option) -> str:
    """Default of an option, a letter where it has to be said."""
    return f"{known.default:g}" if known.accepts(known.default) else "r"


def _choices(sentences: dict[str, str], usual: object = None) -> str:
    told = {name: f"{sentence[:1].lower()}{sentence[1:].rstrip('.')}" for name, sentence in sentences.items()}
    return " · ".join(f'`"{name}"`{" (default)" * (name == usual)}: {words}' for name, words in told.items())


def with_recipe_table(text: str) -> str:
    """Put the table between the marks of a README."""
    return with_block(text, START, recipe_table(), END)


if __name__ == "__main__":
    README.write_text(with_recipe_table(README.read_text(encoding="utf-8")), encoding="utf-8")
