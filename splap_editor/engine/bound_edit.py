"""An edit bound to a surface, and the poses it gives: file → edit → bind → solve → adapt stands here once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels, adapt_kernels, adapted_splats
from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.binding import Binding, Keep, made_anew
from splap_editor.core.deformer import Deformation, Deformer, Handles
from splap_editor.core.deformers import DEFORMERS
from splap_editor.core.handle_nodes import handle_nodes
from splap_editor.core.kept_arrays import Arrays
from splap_editor.core.options import loaded, world_length
from splap_editor.core.place import placed_splats
from splap_editor.core.pose import Pose
from splap_editor.core.progress import Progress, Runner, StageProgress, in_turn, no_progress, part_of, silent
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.cache import StageCache, content_key
from splap_editor.engine.edit import Edit
from splap_editor.engine.quantities import Snapshot
from splap_editor.engine.recipe_edit import edit_of, require_rows_fit
from splap_editor.engine.removal import Removal
from splap_editor.engine.sources import source_hash
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io import plain_edit as plain
from splap_editor.io.splat_files import SplatFile

if TYPE_CHECKING:
    from splap_editor.core.bbw.bbw import WeightedDeformer

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Posed:
    """Every splat of a scene as an edit poses it.

    Parameters
    ----------
    rest : Splats
        As in the file.
    surface : Surface or None
        None where nothing needed it.
    bound : BoundEdit or None
        None where no handle is enabled: then everything is at rest.
    deformation : Deformation or None
    kernels : AdaptedKernels or None
    edit : Edit
        Says what of the splats is written, and where.
    """

    rest: Splats
    surface: Surface | None = None
    bound: BoundEdit | None = None
    deformation: Deformation | None = None
    kernels: AdaptedKernels | None = None
    edit: Edit = field(default_factory=Edit)

    @property
    def splats(self) -> Splats:
        """The file's splats, removed ones included, with the changed rows replaced, in their place; none is split."""
        return written_splats(self.rest, self.kernels, self.edit, self.surface)

    @property
    def snapshot(self) -> Snapshot:
        """What quantities are worked out from; the weight asked for is that of the only handle.

        Raises
        ------
        ValueError
            There is no surface.
        """
        handles = weights = handle = None
        if self.bound is not None:
            handles, weights = self.bound.handles, self.bound.weights
            handle = 0 if len(self.bound.edit.active_handles) == 1 else None
        if self.surface is None:
            raise ValueError("columns need the surface of the scene: pose it with with_surface=True")
        return Snapshot(self.rest, self.surface.ellipses, self.surface, self.kernels, handles, weights, handle)


@dataclass(frozen=True, eq=False)
class BoundEdit:
    """A deformer ready to pose, and what it was made for.

    Parameters
    ----------
    surface : Surface
    edit : Edit
    handles : Handles
    deformer : Deformer
    """

    surface: Surface
    edit: Edit
    handles: Handles
    deformer: Deformer

    @property
    def weights(self) -> NDArray[np.float64] | None:
        """(n, H) handle weights, None where the deformer has none."""
        return None if self.weighted is None else self.weighted.weights

    @property
    def weighted(self) -> WeightedDeformer | None:
        """The deformer, where it has a weight for each handle."""
        return cast("WeightedDeformer", self.deformer) if self.edit.deformer.has_weights else None

    def pose(
        self,
        edit: Edit | Sequence[Pose] | None = None,
        *,
        progress: Progress = no_progress,
        shown: Callable[[Posed], None] | None = None,
    ) -> Posed:
        """Settle the handles at other poses, by default at those of the edit that was bound.

        Parameters
        ----------
        edit : Edit or sequence of Pose, optional
            One that binds like the one bound, or a pose for each enabled handle.
        progress : callable
            Told how far the deformer is.
        shown : callable, optional
            Given intermediate results.

        Raises
        ------
        ValueError
            Not every enabled handle has its pose.
        """
        edit = self._at(edit)
        show = None if shown is None else lambda deformation: shown(self.adapted(edit, deformation))
        return self.adapted(edit, self.deformer.solve(edit.transforms, progress=progress, shown=show))

    def drag(self, edit: Edit | Sequence[Pose]) -> Posed:
        """Pose quickly for the frame of a drag, going on from the frame before; else as `pose`."""
        edit = self._at(edit)
        return self.adapted(edit, self.deformer.drag(edit.transforms))

    def adapted(self, edit: Edit, deformation: Deformation) -> Posed:
        """Adapt every splat of the file to a deformation."""
        kernels = kernels_of(self.surface, edit, deformation)
        return Posed(self.surface.binding.splats, self.surface, self, deformation, kernels, edit)

    def _at(self, poses: Edit | Sequence[Pose] | None) -> Edit:
        """Edit at other poses."""
        if poses is None or isinstance(poses, Edit):
            return poses or self.edit
        held = self.edit.active_handles
        if len(poses) != len(held) or not all(isinstance(pose, Pose) for pose in poses):
            raise ValueError(f"poses must be one Pose for each of the {len(held)} enabled handles, got {poses!r}")
        return self.edit.with_poses({handle.handle_id: pose for handle, pose in zip(held, poses, strict=True)})


def bind(
    surface: Surface,
    edit: Edit | plain.Edit,
    *,
    cache: StageCache | None = None,
    progress: Progress = no_progress,
    stages: StageProgress | None = None,
    run: Runner = in_turn,
) -> BoundEdit:
    """Bind the deformer that an edit names: the slow part of posing, to be done once for a set of handles.

    Parameters
    ----------
    surface : Surface
    edit : Edit, of a scene or plain
        With an enabled handle at least.
    cache : StageCache, optional
        Keeps what took long.
    progress : callable
        Told the share done; may cancel.
    stages : callable, optional
        Told instead, where a deformer has more to say than a share, with words for it.
    run : callable
        Runs independent parts, see `splap_editor.session.side_by_side`.

    Raises
    ------
    UnconstrainedComponentError
        The edit holds nothing.
    ValueError
        The surface was made with other graph options than the edit's.
    """
    edit = edit_of(edit, surface.binding.splats) if isinstance(edit, plain.Edit) else edit
    if surface.options != edit.graph:
        raise ValueError(
            f"the surface was made with {surface.options}, the edit wants {edit.graph}: prepare it with these"
        )
    if not edit.removal.like(Removal(mask=surface.ellipses.removed)):
        raise ValueError("the surface was made of other splats than the edit leaves: prepare it with its removed ones")
    row, handles = edit.deformer, handles_of(surface, edit)
    keep = made_anew if cache is None else _kept_in(cache, (source_hash(*row.modules), surface.key, *_arrays(handles)))
    binding = Binding(progress, stages, run, keep)
    return BoundEdit(surface, edit, handles, row.load()(surface, handles, edit.options[row.options], binding))


def posed(
    file: SplatFile,
    edit: Edit | plain.Edit,
    *,
    cache: StageCache | None = None,
    stages: StageProgress = silent,
    run: Runner = in_turn,
    with_surface: bool = False,
) -> Posed:
    """Pose the splats of a file by an edit, from the graph to the adapted kernels.

    Parameters
    ----------
    file : SplatFile
    edit : Edit, of a scene or plain
        Without an enabled handle everything stays at rest, and no surface is made unless it or a grade's falloff is
        wanted.
    cache, run
        As of `bind`.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    with_surface : bool
        Make the surface in any case.
    """
    if isinstance(edit, plain.Edit):
        require_rows_fit(edit, file)
        edit = edit_of(edit, file.splats)
    surface, bound = bound_file(file, edit, cache=cache, stages=stages, run=run, with_surface=with_surface)
    if bound is None:
        return Posed(file.splats, surface, edit=edit)
    deformation = bound.deformer.solve(edit.transforms, progress=stages("solve"))
    stages("adapt")
    return bound.adapted(edit, deformation)


def bound_file(
    file: SplatFile,
    edit: Edit,
    *,
    cache: StageCache | None = None,
    stages: StageProgress = silent,
    run: Runner = in_turn,
    with_surface: bool = False,
) -> tuple[Surface | None, BoundEdit | None]:
    """Make the surface of a file and bind an edit to it, as far as needed; parameters as of `posed`."""
    if not edit.needs_surface and not with_surface:
        return None, None
    surface = surface_of(file.splats, edit.graph, removed=edit.removed, cache=cache, stages=stages)
    if not edit.active_handles:
        return surface, None
    return surface, bind(surface, edit, cache=cache, progress=stages("bind"), run=run)


def written_splats(
    rest: Splats,
    kernels: AdaptedKernels | None,
    edit: Edit,
    surface: Surface | None = None,
    progress: Progress = no_progress,
) -> Splats:
    """Splats to write: as adapted, then graded, then in their place; ``surface`` is needed by a grade's falloff."""
    splats = unplaced_splats(rest, kernels, edit, surface, part_of(progress, 0.0, 0.7))
    return placed_splats(splats, edit.place, part_of(progress, 0.7, 1.0))


def unplaced_splats(
    rest: Splats,
    kernels: AdaptedKernels | None,
    edit: Edit,
    surface: Surface | None = None,
    progress: Progress = no_progress,
) -> Splats:
    """Splats as adapted, then graded, in the file's coordinates."""
    splats = rest if kernels is None else adapted_splats(rest, kernels, part_of(progress, 0.0, 0.6))
    return edit.grading.graded(splats, surface, part_of(progress, 0.6, 1.0))


def ready_for_drags(surface: Surface, cache: StageCache | None = None) -> None:
    """Make what the first drag of any deformer would wait for, or take it from where it is kept."""
    for ready in dict.fromkeys(row.ready for row in DEFORMERS if row.ready):
        made_by = source_hash(ready.partition(":")[0])
        loaded(ready)(surface, made_anew if cache is None else _kept_in(cache, (made_by, surface.key)))


def handles_of(surface: Surface, edit: Edit) -> Handles:
    """Resolve an edit's regions to nodes of the scene, and its lengths to world units."""
    s, row = surface.scene_scale, edit.deformer
    free = world_length(edit.options[ReachOptions].free_radius, s) if row.has_free_radius else None
    cages = [world_length(handle.cage_radius, s) for handle in edit.active_handles]
    return handle_nodes(
        surface.ellipses,
        [handle.region for handle in edit.active_handles],
        [pin.region for pin in edit.pins],
        free_radius=free,
        cage_radii=[np.inf if radius is None else radius for radius in cages],
        frees=[handle.frees for handle in edit.active_handles],
    )


def kernels_of(surface: Surface, edit: Edit, deformation: Deformation) -> AdaptedKernels:
    """Adapt every splat of the file to a deformation."""
    options = edit.options[AdaptationOptions]
    return adapt_kernels(surface.binding, deformation, method=options.adaptation, hops=options.hops)


def _arrays(handles: Handles) -> tuple[object, ...]:
    return handles.indices, handles.labels, handles.centers, handles.cage_radii


def _kept_in(cache: StageCache, made_from: tuple[object, ...]) -> Keep:
    """Keep results under the hash of what they are made from."""

    def keep(name: object, make: Callable[[], T], packed: Callable[[T], Arrays], unpacked: Callable[[Arrays], T]) -> T:
        return cache.kept(content_key((*made_from, name)), make, packed, unpacked)

    return keep
