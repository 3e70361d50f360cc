"""Bounded biharmonic weights bound to a surface: handles solved side by side, weights kept."""

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import scipy.sparse as sp

from splap_editor.core.bbw.bbw import BbwDeformer, BbwReport, bbw_weights
from splap_editor.core.bbw.box_qp import BoxQpReport
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.bbw.weights import bbw_problem, handle_weight
from splap_editor.core.binding import BindableSurface, Binding
from splap_editor.core.deformer import Handles
from splap_editor.core.kept_arrays import Arrays, require_array, require_rows
from splap_editor.core.options import default_of
from splap_editor.core.progress import part_of


def bind_bbw(surface: BindableSurface, handles: Handles, options: BbwOptions, binding: Binding) -> BbwDeformer:
    """Bind bounded biharmonic weights to a surface, with the weights kept where this handle set was solved before."""
    # The blend is chosen when a handle moves: the weights do not depend on it.
    unblended = replace(options, blending=default_of(BbwOptions, "blending"))
    weights, report = binding.keep(
        unblended,
        lambda: _solved(surface, handles, options, binding),
        lambda made: _packed(*made),
        lambda kept: _unpacked(kept, (len(surface.rest), handles.n_handles)),
    )
    return BbwDeformer.from_weights(surface.rest, handles, weights, options=options, report=report)


def _solved(
    surface: BindableSurface, handles: Handles, options: BbwOptions, binding: Binding
) -> tuple[sp.csr_array, BbwReport]:
    began = time.perf_counter()
    problem = bbw_problem(
        surface.rest, surface.L, surface.M, handles, options=options, progress=part_of(binding.progress, 0.0, 0.1)
    )
    shared = time.perf_counter() - began

    def told(shares: Sequence[float]) -> None:
        """Tell how far the weights are, as the mean of the handles' shares."""
        progress = binding.progress if binding.stages is None else binding.stages(_words(shares))
        progress(0.1 + 0.9 * float(np.mean(shares)))

    solved = binding.run([partial(handle_weight, problem, h) for h in range(handles.n_handles)], told)
    return bbw_weights(problem, solved, surface.graph, shared_seconds=shared)


def _words(shares: Sequence[float]) -> str:
    """Say how far the first unfinished handle is."""
    handle = next((h for h, share in enumerate(shares) if share < 1.0), len(shares) - 1)
    return f"weights: handle {handle + 1} of {len(shares)}, {100 * shares[handle]:.0f} %"


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
