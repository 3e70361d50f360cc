"""A stage is named after the source that makes it."""

from splap_editor.core.arap.options import ARAP_SOLVERS, ArapOptions
from splap_editor.core.deformers import deformer_row
from splap_editor.core.options import OptionSet
from splap_editor.engine import sources
from splap_editor.engine.sources import source_hash


def changed(monkeypatch, module):
    """Hashes as if a line had been added to a module."""
    held = sources.source_text
    monkeypatch.setattr(sources, "source_text", lambda name: held(name) + ("\n# more\n" if name == module else ""))


def test_a_change_of_a_module_that_is_called_changes_the_hash(monkeypatch):
    root = "splap_editor.core.bbw.binding"
    before, other = source_hash(root), source_hash("splap_editor.core.graph.offset_rule")
    changed(monkeypatch, "splap_editor.core.bbw.box_qp")
    assert source_hash(root) != before
    assert source_hash("splap_editor.core.graph.offset_rule") == other


def test_the_closure_holds_what_is_imported_and_no_more():
    found = sources.with_imports(frozenset({"splap_editor.core.arap.binding"}))
    assert {"splap_editor.core.arap.minimiser", "splap_editor.core.linear_solvers"} <= found
    assert not any(name.startswith(("splap_editor.core.bbw", "splap_editor.io")) for name in found)
    assert all(choice.module not in found for choice in list(ARAP_SOLVERS.values())[1:]), (
        "named rows are roots themselves"
    )


def test_what_a_table_names_counts_as_source(monkeypatch):
    rows = [deformer_row("arap", OptionSet(ArapOptions(kind=kind))) for kind in ("converged", "libigl")]
    before = [source_hash(*row.modules) for row in rows]
    changed(monkeypatch, "splap_editor.core.arap.plain_arap")
    after = [source_hash(*row.modules) for row in rows]
    assert after[0] == before[0] and after[1] != before[1]


def test_the_same_sources_give_the_same_hash_in_any_order():
    a, b = "splap_editor.core.graph.options", "splap_editor.core.progress"
    assert source_hash(a, b) == source_hash(b, a) != source_hash(a)
