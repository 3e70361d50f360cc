"""Bounded biharmonic weights as numbers per splat and in words."""

from splap_editor.core.bbw.bbw import BbwReport
from splap_editor.engine.edit import Edit

EXACT = 1e-12
"""Violations below this are roundoff."""

KKT_WARNING = 1e-3
"""Steps of a weight left to go that a person would see."""


def weight_lines(edit: Edit, report: BbwReport) -> list[tuple[str, str]]:
    """Say in an artist's words whether the weights are good, and what they do not reach.

    Parameters
    ----------
    edit : Edit
        The edit they were bound for.
    report : BbwReport

    Returns
    -------
    list of (str, str)
        A sentence, and ``"quiet"`` or ``"warning"``.
    """
    lines = []
    for index, (handle, qp) in enumerate(zip(edit.active_handles, report.handles, strict=True)):
        if index in report.unreachable:
            lines.append(
                (
                    f"{handle.name} moves only its own splats: no free splat that hangs together with it lies in its "
                    "cage. Widen the cage, or join the pieces.",
                    "warning",
                )
            )
            continue
        is_rough = qp.fallback or qp.kkt_residual > KKT_WARNING
        quality = "; they are rough, so look at them before you trust them (Shift+W)" if is_rough else ""
        words = f"{handle.name} pulls {report.n_unknowns[index]:,} splats{quality}."
        lines.append((words, "warning" if is_rough else "quiet"))
    if report.n_specks:
        lines.append((f"{report.n_specks:,} splats in loose specks follow their nearest neighbour.", "quiet"))
    if report.n_resting:
        lines.append((f"{report.n_resting:,} splats in pieces that no handle touches stay at rest.", "quiet"))
    return lines


def weight_figures(edit: Edit, report: BbwReport) -> list[str]:
    """How well the weights of each handle are solved, in numbers: a line for each that reaches anything."""
    lines = []
    for index, (handle, qp) in enumerate(zip(edit.active_handles, report.handles, strict=True)):
        if index not in report.unreachable:
            n = qp.n_factorisations
            lines.append(
                f"{handle.name}: {n} factorisation{'s' if n != 1 else ''}, KKT residual {qp.kkt_residual:.0e}, "
                f"bounds met {_closely(qp.bound_violation)}"
                + (", by the interior-point fallback since the active set did not settle" if qp.fallback else "")
            )
    return lines


def _closely(violation: float) -> str:
    return "exactly" if violation < EXACT else f"to {violation:.0e}"
