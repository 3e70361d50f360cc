"""Pictures of the methods side by side, as in the paper's figures: the same pull of the same splats by each of them.

The scenes are those where the editor is farthest above the paper's rule, and its worst failure, among the rows that a
run of `tests.benchmark.paper` has kept::

    xvfb-run -a python -m tests.benchmark.paper_pictures --rows resources/evidence
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels, adapted_splats
from splap_editor.core.adaptation.kernel_binding import KernelBinding
from splap_editor.core.arap.rotation_fit import fit_rotations
from splap_editor.core.deformer import Deformation
from splap_editor.core.progress import no_progress
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.neighborhoods import nearest_in_space
from splap_editor.viewport.camera import View
from splap_editor.viewport.splat_actor import DisplayMode, SplatLook
from splap_editor.viewport.studio import Studio
from tests.benchmark.fidelity import Scene
from tests.benchmark.ground_truth import GroundTruth, Pull
from tests.benchmark.paper import deformed, held
from tests.benchmark.paper_methods import METHODS, Bound, NoProxyError
from tests.benchmark.paper_rows import RowFile
from tests.benchmark.paper_scenes import Case, scene_of
from tests.benchmark.paper_tables import scene_of as scene_name
from tests.benchmark.peers import note

SHOWN = ("oracle", "ours", "paper", "knn10", "mahalanobis10", "mani-gs", "sugar", "cage")
SIZE = 420, 340
N_COLUMNS = 3
CAPTION_PX = 22
NEAR = 0.2
"""Distance from a handle, in s, within which what is there is turned towards the eye."""


def view_of(focus: NDArray[np.float64], pull: Pull, truth: GroundTruth) -> View:
    """Look at a pull from outside the object, square to how what is around it lies and moves: parts part in view."""
    near = truth.vertices[np.linalg.norm(truth.vertices - pull.center, axis=1) < NEAR * truth.size]
    spread = np.concatenate([near, near + pull.move]) - focus
    side = np.linalg.svd(spread, full_matrices=False)[2][2]
    out = focus - 0.5 * (truth.vertices.min(axis=0) + truth.vertices.max(axis=0))
    side = side if side @ out >= 0.0 else -side
    # A little from aside, so that what lies behind each other is seen.
    up = np.eye(3)[np.argmin(np.abs(side[[1, 2]])) + 1]
    across = np.cross(up, side) / np.linalg.norm(np.cross(up, side))
    eye = focus + 1.2 * truth.size * (side + 0.3 * across + 0.2 * up)
    return View(eye, focus, up)


@contextmanager
def studio_of(splats: Splats, size: tuple[int, int]) -> Iterator[Studio]:
    """Set splats up for pictures of them alone, on nothing."""
    studio = Studio(splats, SplatLook(mode=DisplayMode.SPLATS), *size)
    try:
        studio.viewport.triad.is_shown = False
        yield studio
    finally:
        studio.close()


def picture_of(splats: Splats, view: View) -> NDArray[np.uint8]:
    """(H, W, 4) RGBA of splats from a view."""
    with studio_of(splats, SIZE) as studio:
        return studio.picture(view, is_transparent=True)


def posed(scene: Scene, bound: Bound, deformation: Deformation) -> Splats:
    """Splats of a method after a deformation, all adapted as the editor adapts them.

    Where a method's nodes are no splats, each splat turns as its nearest in space went.
    """
    if bound.binding is not None:
        return adapted_splats(scene.splats, adapt_kernels(bound.binding, deformation))
    ellipses = scene.ellipses
    near = nearest_in_space(ellipses, None, 10, no_progress)
    positions = bound.carried(deformation, ellipses.rows)
    starts = np.repeat(np.arange(ellipses.n_nodes), np.diff(near.indptr))
    rest, moved = (each[near.indices] - each[starts] for each in (ellipses.centers, positions))
    covariances = np.zeros((ellipses.n_nodes, 3, 3))
    np.add.at(covariances, starts, rest[:, :, None] * moved[:, None, :])
    binding = KernelBinding(scene.splats, ellipses, near)
    return adapted_splats(
        scene.splats, adapt_kernels(binding, Deformation(positions, fit_rotations(covariances)))
    )  # fmt: skip


def strip(case: Case, number: int, solver: str, n_pulls: int, shown: Sequence[str] = SHOWN) -> Image.Image:
    """Draw the resting splats and each method on one pull, side by side."""
    _, scene = scene_of(case, n_pulls)
    pull = scene.pulls[number]
    view = view_of(pull.center + 0.5 * pull.move, pull, scene.truth)
    panels = [("At rest", picture_of(scene.splats, view))]
    for name in shown:
        if METHODS[name].is_missing:
            continue
        try:
            bound = METHODS[name].bind(scene)
        except NoProxyError:
            continue
        handle, _ = held(scene.truth.vertices_of(bound.rest), bound.rest, pull, scene.truth.size)
        deformation = deformed(solver, bound, handle, pull, scene.truth.size)
        panels.append((METHODS[name].title, picture_of(posed(scene, bound, deformation), view)))
    width, height = SIZE[0], SIZE[1] + CAPTION_PX
    sheet = Image.new("RGB", (width * N_COLUMNS, height * -(-len(panels) // N_COLUMNS)), "white")
    pen = ImageDraw.Draw(sheet)
    for place, (title, pixels) in enumerate(panels):
        row, column = divmod(place, N_COLUMNS)
        drawn = Image.fromarray(pixels, "RGBA")
        sheet.paste(drawn, (column * width, row * height + CAPTION_PX), drawn)
        pen.text((column * width + 6, row * height + 4), title, fill="black")
    return sheet


def chosen(rows: Sequence[dict[str, object]], solver: str) -> dict[str, tuple[dict[str, object], int]]:
    """Rows of the editor, and which pull: farthest above the paper's rule, and below the ceiling, at τ = .075."""
    places = {(scene_name(row), row["candidate"]): row for row in rows if row["solver"] == solver and row["spacings"]}
    found = {}
    for title, other, sign in (("best", "paper", 1.0), ("worst", "oracle", -1.0)):
        most = -np.inf
        for (scene, candidate), row in places.items():
            beside = places.get((scene, other))
            if candidate != "ours" or beside is None:
                continue
            ahead = sign * (np.array(row["pulls"])[:, 1] - np.array(beside["pulls"])[:, 1])
            if ahead.max() > most:
                most, found[title] = ahead.max(), (row, int(ahead.argmax()))
    return found


def _case(row: dict[str, object]) -> Case:
    return Case(*(row[name] for name in ("category", "seed", "regime", "spacings", "handles")))


def main(given: list[str] | None = None) -> None:
    """Draw the strips that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=Path, metavar="FOLDER", required=True, help="of a run's rows; pictures go there")
    parser.add_argument("--method", default="arap", help="deformer (arap)")
    options = parser.parse_args(given)
    rows = RowFile(options.rows / "rows.jsonl").rows()
    for title, (row, number) in chosen(rows, options.method).items():
        note(f"{title}: {row['category']} {row['seed']}, {row['regime']}, gap {row['gap']}, pull {number}")
        sheet = strip(_case(row), number, options.method, int(row["n_pulls"]))
        sheet.quantize(128).save(options.rows / f"pull-{title}.png", optimize=True)


if __name__ == "__main__":
    main()
