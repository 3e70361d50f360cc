"""As-rigid-as-possible deformation bound to a surface, by whichever solver its options name."""

from splap_editor.core.arap.arap import ArapDeformer
from splap_editor.core.arap.options import ARAP_SOLVERS, ArapOptions
from splap_editor.core.arap.scene import ArapScene
from splap_editor.core.binding import BindableSurface, Binding, Keep
from splap_editor.core.deformer import Handles


def arap_scene(surface: BindableSurface) -> ArapScene:
    """What all handle sets of a scene share; its coarse model is made when first dragged."""
    return ArapScene(surface.rest, surface.L, surface.graph)


def ready_arap(surface: BindableSurface, keep: Keep) -> None:
    """Make the coarse model, so that the first drag need not wait for it."""
    surface.shared(arap_scene).ready(keep)


def arap_deformer(*arguments: object, options: ArapOptions = ArapOptions(), **others: object) -> ArapDeformer:
    """Make the deformer that ``options.kind`` names; the other arguments are those of `ArapDeformer`."""
    return ARAP_SOLVERS[options.kind].load()(*arguments, options=options, **others)


def bind_arap(surface: BindableSurface, handles: Handles, options: ArapOptions, binding: Binding) -> ArapDeformer:
    """Bind as-rigid-as-possible deformation to a surface and a handle set."""
    return arap_deformer(
        surface.rest,
        surface.L,
        handles,
        scene_scale=surface.scene_scale,
        M=surface.M,
        graph=surface.graph,
        triangles=surface.triangles,
        options=options,
        scene=surface.shared(arap_scene),
        progress=binding.progress,
    )
