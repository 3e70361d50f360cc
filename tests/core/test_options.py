"""Options say of themselves what is refused, and stand in sets that compare."""

from dataclasses import dataclass

import numpy as np
import pytest

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.deformers import DEFORMERS
from splap_editor.core.graph.options import GRAPH_RULES, LAPLACIANS, NEIGHBORHOODS, GraphOptions, edges_only
from splap_editor.core.options import (
    Choice,
    OptionSet,
    ShareOfSize,
    check_options,
    loaded,
    option,
    options_of,
    world_length,
)
from splap_editor.core.reach_options import CageOptions, ReachOptions


@dataclass(frozen=True)
class Every:
    """An option of every kind."""

    way: str = option("a", "Which way.", choices={"a": Choice("A"), "b": Choice("B")})
    is_on: bool = option(False, "Whether.")
    count: int = option(3, "How many.", least=1, most=9)
    share: float = option(0.5, "How much.", above=0.0, most=1.0)
    reach: object = option(ShareOfSize(0.5), "How far.", above=0.0)
    pairs: tuple = option((), "Which.")

    def __post_init__(self) -> None:
        check_options(self)


@pytest.mark.parametrize(
    ("name", "value", "wanted"),
    [
        ("way", "c", '"a" or "b"'),
        ("is_on", 1, "true or false"),
        ("count", 0, "a whole number, 1 to 9"),
        ("count", 10, "a whole number"),
        ("count", True, "a whole number"),
        ("count", 3.0, "a whole number"),
        ("share", 0.0, "a finite number greater than 0 and at most 1"),
        ("share", float("nan"), "a finite number"),
        ("share", 10**400, "a finite number"),
        ("reach", -1.0, "a finite number greater than 0"),
        ("reach", ShareOfSize(0.0), "a finite number greater than 0"),
        ("reach", float("nan"), "a finite number"),
        ("pairs", 3, "pairs"),
    ],
)
def test_a_value_that_an_option_may_not_have_is_refused(name, value, wanted):
    with pytest.raises(ValueError, match=f"{name} must be .*{wanted}"):
        Every(**{name: value})


def test_values_within_bounds_are_taken_numpys_too():
    held = Every("b", True, np.int64(9), np.float32(1.0), None, ((1, 2),))
    assert held.count == 9 and held.reach is None
    assert Every(reach=2.0).reach == 2.0


def test_a_length_is_resolved_in_units_of_the_size():
    assert world_length(ShareOfSize(0.5), 4.0) == 2.0
    assert world_length(1.5, 4.0) == 1.5
    assert world_length(None, 4.0) is None


def test_a_set_holds_one_group_of_a_kind_and_its_default_otherwise():
    options = OptionSet(ArapOptions(iterations=3), ReachOptions(None))
    assert options[ArapOptions].iterations == 3
    assert options[GraphOptions] == GraphOptions()
    assert options.with_groups(ArapOptions()) == OptionSet(ReachOptions(None))
    assert OptionSet(GraphOptions()) == OptionSet() != options
    assert hash(OptionSet(ReachOptions(None), ArapOptions(iterations=3))) == hash(options)


def test_every_option_says_what_it_does_and_has_a_default_that_it_accepts():
    for group in (GraphOptions, ReachOptions, CageOptions, AdaptationOptions, *(row.options for row in DEFORMERS)):
        for name, known in options_of(group).items():
            assert known.sentence.endswith("."), name
            assert known.label or known.kind in ("pairs", "strokes"), name
            assert known.accepts(getattr(group(), name)), name


def test_every_row_of_a_table_names_a_function_that_there_is():
    for row in (*GRAPH_RULES.values(), *NEIGHBORHOODS.values(), *LAPLACIANS.values(), *DEFORMERS):
        assert callable(row.load())
    for named in [row.ready for row in DEFORMERS] + [row.mended for row in NEIGHBORHOODS.values()]:
        assert not named or callable(loaded(named))


def test_the_graph_depends_on_no_option_of_what_is_made_from_it():
    options = GraphOptions("paper", 0.01, 12, cut=((1, 2),), laplacian="robust")
    assert edges_only(options) == GraphOptions("paper", 0.01, cut=((1, 2),))
