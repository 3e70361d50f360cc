"""What makes two splats neighbours, and what the surface's stages are made by: options and their tables."""

from dataclasses import dataclass, replace

from splap_editor.core.options import Choice, check_options, option

GRAPH_RULES = {
    "touch": Choice(
        "Best contacts",
        "Each splat's best contacts, as far as they are mutual, and the best contacts between what that leaves apart.",
        "splap_editor.core.graph.touch_rule:touch_edges",
    ),
    "paper": Choice(
        "All within the gap",
        "Every pair with a normal-wise offset of at most ε.",
        "splap_editor.core.graph.offset_rule:offset_edges",
    ),
}
"""Rules by name: ``rule(tree, epsilon, progress)`` gives (E, 2) edges and their (E,) touch scales or None."""

CARRIERS = {
    "auto": Choice(
        "What the splats are like",
        "Splats fainter than 0.1 are haze and follow; unless the splats are flat, which lie in the surface however "
        "faint, or most of them are faint.",
        "splap_editor.core.graph.carriers:solid_unless_flat",
    ),
    "all": Choice(
        "Every splat",
        "Every visible splat belongs to the surface.",
        "splap_editor.core.graph.carriers:all_splats",
    ),
    "solid": Choice(
        "Splats that are not faint",
        "Splats fainter than 0.1 are haze: they follow the surface and do not hold it together.",
        "splap_editor.core.graph.carriers:solid_splats",
    ),
}
"""Who makes up the surface, by name: ``carries(ellipses, splats)`` gives (n,) bool; the others follow."""


@dataclass(frozen=True)
class MendedChoice(Choice):
    """A row of the table of neighbourhoods, or of Laplacians.

    Parameters
    ----------
    mended : str
        ``"module:name"`` of what brings them up to date after edges were cut or added, see `mended_neighborhoods` and
        `mended_star_laplacian`; without it all is made again.
    """

    mended: str = ""


NEIGHBORHOODS = {
    "geodesic": MendedChoice(
        "Along the surface",
        "The k nearest by shortest path on the graph.",
        "splap_editor.core.surface.neighborhoods:nearest_along_surface",
        mended="splap_editor.core.surface.geodesics:mended_neighborhoods",
    ),
    "edges": MendedChoice(
        "Joined by an edge",
        "Those that an edge of the graph leads to, however many.",
        "splap_editor.core.surface.neighborhoods:joined_by_edges",
    ),
    "space": MendedChoice(
        "In space",
        "The k nearest centres, whatever lies between.",
        "splap_editor.core.surface.neighborhoods:nearest_in_space",
    ),
    "mahalanobis": MendedChoice(
        "By Mahalanobis",
        "The k nearest as each splat's own ellipse measures, a tenth as thick as it is narrow.",
        "splap_editor.core.surface.neighborhoods:nearest_by_mahalanobis",
    ),
}
"""Neighbourhoods by name: ``neighbors(ellipses, graph, k, progress)`` gives `Neighborhoods`."""

LAPLACIANS = {
    "stars": MendedChoice(
        "Cotangents of the stars",
        "Cotangents of the local Delaunay stars, summed.",
        "splap_editor.core.surface.laplacian:star_weights",
        mended="splap_editor.core.surface.laplacian:mended_star_laplacian",
    ),
    "robust": MendedChoice(
        "Intrinsic Delaunay",
        "Intrinsic Delaunay weights of the stars' union as one non-manifold mesh.",
        "splap_editor.core.surface.laplacian:robust_weights",
    ),
}
"""Laplacians by name: ``weights(centers, triangles)`` gives (n, n) symmetric weights, not negative, and (n,) masses."""


Point = tuple[float, float, float]


@dataclass(frozen=True)
class Separation:
    """Two parts that were pointed at to be taken apart, see `splap_editor.core.surface.separation.seam_between`.

    Parameters
    ----------
    a, b : tuple of 3 floats
        Places on the surface at rest, world units; one a part is enough. The nearest active splats are meant, so that
        a stroke holds on another training of the same scene.
    wider : int
        So many seams more, or fewer if negative, than the one that parts them.
    """

    a: tuple[Point, ...]
    b: tuple[Point, ...]
    wider: int = option(0, "Seams beyond the one that parts them; negative: before it.", least=-24, most=24)

    def __post_init__(self) -> None:
        _check_parts(self)


@dataclass(frozen=True)
class Joint:
    """Two rims that were pointed at to be tied together by their best contacts.

    Parameters
    ----------
    a, b : tuple of 3 floats
        As in a `Separation`.
    reach : float
        Largest distance of two centres that are joined, in world units.
    """

    a: tuple[Point, ...]
    b: tuple[Point, ...]
    reach: float = option(0.0, "Largest distance of two centres that are joined.", above=0.0, unit="world")

    def __post_init__(self) -> None:
        _check_parts(self)


def _check_parts(stroke: Separation | Joint) -> None:
    """Raise a ValueError if a part is nowhere or an option is none."""
    for name in ("a", "b"):
        if not getattr(stroke, name):
            raise ValueError(f"{name} needs at least one point")
    check_options(stroke)


@dataclass(frozen=True)
class GraphOptions:
    """What makes two splats neighbours.

    Parameters
    ----------
    rule : str
        One of `GRAPH_RULES`.
    epsilon : float
        Tolerance along the normals in units of the scene scale.
    k : int
        Number of geodesic neighbours the Laplacian is built from.
    cut, add : tuple of (int, int)
        Edges taken out of and put into the finished graph, as pairs of file rows.
    separate : tuple of Separation
        Parts taken apart, after cut and added edges, each in what the ones before it left.
    join : tuple of Joint
        Parts tied together, after that.
    neighborhood : str
        One of `NEIGHBORHOODS`.
    laplacian : str
        One of `LAPLACIANS`.
    carriers : str
        One of `CARRIERS`.
    """

    rule: str = option("touch", "How neighbours are chosen.", label="Rule", choices=GRAPH_RULES)
    epsilon: float = option(
        0.005,
        "Gap that still counts as touching, in units of the size.",
        label="Gap ε",
        least=0.0,
        unit="of s",
        is_percent=True,
        step=0.0005,
        decimals=5,
    )
    k: int = option(
        30, "Nearest along the surface that the Laplacian is made of.", label="Neighbours k", least=3, most=1000
    )
    cut: tuple[tuple[int, int], ...] = option((), "Edges taken out of the finished graph, as pairs of file rows.")
    add: tuple[tuple[int, int], ...] = option((), "Edges put into the finished graph, as pairs of file rows.")
    separate: tuple[Separation, ...] = option(
        (), "Parts taken apart along the narrowest seam between the places pointed at.", strokes=Separation
    )
    join: tuple[Joint, ...] = option((), "Parts tied together by their best contacts.", strokes=Joint)
    neighborhood: str = option("geodesic", "Who counts as near a splat.", label="Nearest by", choices=NEIGHBORHOODS)
    laplacian: str = option(
        "stars", "How the stars of all splats become a Laplacian.", label="Laplacian", choices=LAPLACIANS
    )
    carriers: str = option(
        "auto", "Which splats make up the surface; the others follow it.", label="Made of", choices=CARRIERS
    )

    def __post_init__(self) -> None:
        check_options(self)


EDGE_OPTIONS = ("rule", "epsilon", "cut", "add", "separate", "join")
"""Options that the graph itself is made by; the others are for what is made of it."""


def edges_only(options: GraphOptions) -> GraphOptions:
    """Options with everything at its default that the graph's edges do not depend on."""
    return replace(GraphOptions(), **{name: getattr(options, name) for name in EDGE_OPTIONS})
