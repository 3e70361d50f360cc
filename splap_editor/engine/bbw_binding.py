"""Bounded biharmonic weights for the session: handles side by side, weights kept between runs."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.bbw.bbw import BbwDeformer, BbwReport, bbw_weights
from splap_editor.core.bbw.box_qp import BoxQpReport
from splap_editor.core.bbw.weights import BbwOptions, bbw_problem, handle_weight
from splap_editor.core.deformer import Handles
from splap_editor.core.progress import Cancelled, Progress, part_of
from splap_editor.engine.cache import Arrays, StageCache, content_key, require_array, require_rows

WEIGHTS_VERSION = 4
"""Raised whenever the solver gives other weights than before, or they are kept otherwise."""

N_THREADS = 4
"""Handles solved at a time unless told otherwise; factorisation and compiled loops let go of Python's lock."""

_REPORT_SECONDS = 0.05

StageProgress = Callable[[str], Progress]


def bbw_deformer(
    surface,
    handles: Handles,
    *,
    blending: str,
    cache: StageCache | None,
    progress: Progress,
    stages: StageProgress | None = None,
    n_threads: int = N_THREADS,
) -> BbwDeformer:
    """Bind bounded biharmonic weights, from the cache where this handle set was solved before.

    Parameters
    ----------
    surface : Surface
    handles : Handles
    blending : str
        ``"dual-quaternion"`` or ``"linear"``.
    cache : StageCache, optional
    progress : callable
        Told the mean share of the handles; may cancel.
    stages : callable, optional
        ``stages(words)`` gives the progress callback to tell instead, the words saying how far which handle is.
    n_threads : int
        Handles solved at a time; the weights do not depend on it.
    """
    options = BbwOptions(blending=blending)
    rest = surface.ellipses.centers
    key = content_key(
        ("bbw", WEIGHTS_VERSION, surface.key, handles.indices, handles.labels, handles.centers, handles.cage_radii)
    )
    shape = len(rest), handles.n_handles
    kept = cache.load(key, lambda arrays: _unpacked(arrays, shape)) if cache is not None else None
    weights, report = kept or _solved(surface, handles, options, progress, stages, n_threads)
    if cache is not None and kept is None:
        cache.store(key, _packed(weights, report))
    return BbwDeformer.from_weights(rest, handles, weights, options=options, report=report)


def _solved(surface, handles, options, progress, stages, n_threads):
    began = time.perf_counter()
    problem = bbw_problem(
        surface.ellipses.centers, surface.L, surface.M, handles, options=options, progress=part_of(progress, 0.0, 0.1)
    )
    shared = time.perf_counter() - began
    shares = np.zeros(max(handles.n_handles, 1))
    is_cancelled = False

    def of_handle(handle: int) -> Progress:
        def told(share: float) -> None:
            shares[handle] = share
            if is_cancelled:
                raise Cancelled

        return told

    with ThreadPoolExecutor(n_threads, thread_name_prefix="splap-bbw") as threads:
        futures = [threads.submit(handle_weight, problem, h, of_handle(h)) for h in range(handles.n_handles)]
        try:
            is_under_way = bool(futures)
            while is_under_way:
                told = progress if stages is None else stages(_words(shares, [future.done() for future in futures]))
                told(0.1 + 0.9 * float(shares.mean()))
                is_under_way = bool(wait(futures, timeout=_REPORT_SECONDS).not_done)
        except Cancelled:
            is_cancelled = True
            raise
    return bbw_weights(problem, [future.result() for future in futures], surface.graph, shared_seconds=shared)


def _words(shares: NDArray[np.float64], done: list[bool]) -> str:
    """Say how far the first unfinished handle is."""
    handle = done.index(False) if False in done else len(done) - 1
    return f"weights: handle {handle + 1} of {len(done)}, {100 * shares[handle]:.0f} %"


def _packed(weights: sp.csr_array, report: BbwReport) -> Arrays:
    qp = np.array(
        [(q.kkt_residual, q.bound_violation, q.n_factorisations, q.fallback) for q in report.handles], np.float64
    ).reshape(-1, 4)
    return {
        "weights_indptr": weights.indptr.astype(np.int32),
        "weights_indices": weights.indices.astype(np.int32),
        "weights_data": weights.data,
        "qp": qp,
        "n_unknowns": np.array(report.n_unknowns, np.int64),
        "unreachable": np.array(report.unreachable, np.int64),
        "counts": np.array([report.n_specks, report.n_resting], np.int64),
    }


def _unpacked(kept: Arrays, shape: tuple[int, int]) -> tuple[sp.csr_array, BbwReport]:
    """Weights (n, H) and their report from the cache."""
    n_nodes, n_handles = shape
    require_rows(kept, "weights", n_nodes, n_handles)
    require_array(kept["weights_data"], "weights_data", kept["weights_indices"].shape, np.float64)
    require_array(kept["qp"], "qp", (n_handles, 4), np.float64)
    require_array(kept["n_unknowns"], "n_unknowns", (None,), np.int64)
    require_array(kept["unreachable"], "unreachable", (None,), np.int64)
    require_array(kept["counts"], "counts", (2,), np.int64)
    weights = sp.csr_array((kept["weights_data"], kept["weights_indices"], kept["weights_indptr"]), shape=shape)
    report = BbwReport(
        handles=tuple(
            BoxQpReport(kkt, violation, int(count), bool(fell)) for kkt, violation, count, fell in kept["qp"]
        ),
        n_unknowns=tuple(kept["n_unknowns"].tolist()),
        seconds=(0.0,) * len(kept["qp"]),
        unreachable=tuple(kept["unreachable"].tolist()),
        n_specks=int(kept["counts"][0]),
        n_resting=int(kept["counts"][1]),
    )
    return weights, report
