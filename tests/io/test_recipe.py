"""Recipes come back as they were, and a wrong one is refused by the name of its key."""

import json
import math

import numpy as np
import pytest

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.grade import GradeStep
from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.options import OptionSet, ShareOfSize
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import CageOptions, ReachOptions
from splap_editor.core.removal import PickedBall
from splap_editor.io.recipe import (
    Edit,
    Handle,
    Pin,
    RecipeError,
    read_recipe,
    recipe_from_json,
    recipe_keys,
    recipe_to_json,
    write_recipe,
)

BALL = {"center": [0, 0, 0], "radius": 1}


def test_no_key_means_two_things():
    assert len(set(recipe_keys())) == len(recipe_keys())


def random_recipe(seed):
    rng = np.random.default_rng(seed)

    def vector(n=3, scale=1.0):
        return tuple((rng.normal(size=n) * scale).tolist())

    def region(handle):
        if rng.integers(2):
            return {"center": vector(scale=1e3), "radius": float(rng.exponential())}
        rows = {"rows": tuple(rng.integers(0, 10**6, 5).tolist())}
        return rows | ({"center": vector()} if rng.integers(2) else {})

    def maybe(**values):
        return {key: value for key, value in values.items() if rng.integers(2)}

    def radius(usual):
        return [None, usual, float(rng.exponential())][rng.integers(3)]

    def unit():
        quat = vector(4)
        return tuple(part / math.hypot(*quat) for part in quat)

    pairs = tuple((int(a), int(a + 1)) for a in rng.integers(0, 99, 3))
    ball = PickedBall(vector(), float(rng.exponential()))
    grades = (
        GradeStep(GradeOptions(**maybe(exposure=0.1 / 3, hue=-20.0, opacity=0.0))),
        GradeStep(GradeOptions(**maybe(contrast=0.1 / 3, falloff=2.0)), ball, bool(rng.integers(2))),
    )
    return Edit(
        handles=tuple(
            Handle(
                name=["hand", "Fuß", 'a "b"\n', ""][rng.integers(4)],
                **region(True),
                **maybe(translate=vector(), rotate=unit(), cage_radius=radius(CageOptions.cage_radius)),
                **maybe(scale=[0.5, tuple(rng.exponential(size=3).tolist())][rng.integers(2)]),
            )
            for _ in range(rng.integers(4))
        ),
        pins=tuple(Pin(**region(False)) for _ in range(rng.integers(4))),
        options=OptionSet(
            GraphOptions(**maybe(rule="paper", epsilon=0.1 / 3, k=20, cut=pairs, add=pairs, laplacian="robust")),
            ArapOptions(**maybe(kind="local-global", tolerance=1e-5 / 3, iterations=3, smoothness=0.0)),
            ReachOptions(radius(ReachOptions.free_radius)),
            AdaptationOptions(**maybe(adaptation="affine", hops=3)),
            BbwOptions(**maybe(blending="linear")),
        ),
        **maybe(method="bbw", grade=grades),
    )


@pytest.mark.parametrize("seed", range(30))
def test_a_recipe_comes_back_exactly(seed, tmp_path):
    recipe = random_recipe(seed)
    assert recipe_from_json(recipe_to_json(recipe)) == recipe
    write_recipe(tmp_path / "a.json", recipe)
    assert read_recipe(tmp_path / "a.json") == recipe
    held = (tmp_path / "a.json").read_bytes()
    write_recipe(tmp_path / "a.json", read_recipe(tmp_path / "a.json"))
    assert (tmp_path / "a.json").read_bytes() == held


def test_what_is_left_out_takes_its_default():
    recipe = recipe_from_json({"version": 1, "handles": [BALL]})
    assert recipe == Edit(handles=(Handle("handle 1", (0, 0, 0), 1),))
    assert recipe.options[GraphOptions] == GraphOptions("touch", 0.005, 30)
    assert recipe.options[ArapOptions] == ArapOptions("converged", 1e-4, 10, 0.001)
    assert recipe.options[ReachOptions].free_radius == ShareOfSize(0.5)
    assert recipe.handles[0].cage_radius == ShareOfSize(0.3)


def test_null_frees_everything():
    recipe = recipe_from_json({"version": 1, "free_radius": None, "handles": [{**BALL, "cage_radius": None}]})
    assert recipe.options[ReachOptions].free_radius is None
    assert recipe.handles[0].cage_radius is None


def test_a_pin_may_have_a_name():
    recipe = Edit(pins=(Pin((0.0, 0.0, 1.0), 0.5, name="foot"), Pin(rows=(1, 2))))
    held = recipe_to_json(recipe)
    assert [pin.get("name") for pin in held["pins"]] == ["foot", None]
    assert recipe_from_json(held) == recipe
    held["pins"][0]["name"] = 3
    with pytest.raises(RecipeError, match=r"pins\[0\]\.name"):
        recipe_from_json(held)


def test_the_documented_recipe_is_read():
    text = """
    {"version": 1, "method": "bbw", "graph": {"rule": "paper", "epsilon": 0.005, "k": 30, "cut": [[1, 2]], "add": []},
     "free_radius": 1.3,
     "handles": [{"name": "hand", "center": [1, 2, 3], "radius": 0.5, "translate": [0, 0, 1],
                  "rotate": [2, 0, 0, 0], "scale": 1.5, "cage_radius": 0.7}],
     "pins": [{"rows": [5, 6]}], "blending": "linear",
     "solver": {"kind": "libigl", "iterations": 10, "smoothness": 0.001}, "adaptation": "affine", "hops": 2}
    """
    recipe = recipe_from_json(json.loads(text))
    handle = Handle("hand", (1, 2, 3), 0.5, translate=(0, 0, 1), scale=1.5, cage_radius=0.7)
    assert recipe.handles == (handle,)
    assert recipe.pins == (Pin(rows=(5, 6)),)
    options = recipe.options
    assert options[GraphOptions].cut == ((1, 2),)
    assert options[AdaptationOptions] == AdaptationOptions("affine", 2)
    assert (options[BbwOptions].blending, options[ArapOptions].kind) == ("linear", "libigl")


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"version": None}, "version is missing"),
        ({"version": 2}, "version must be 1, got 2"),
        ({"version": True}, "version must be 1, got true"),
        ({"version": "1"}, 'version must be 1, got "1"'),
        ({"handels": []}, "handels is not known: did you mean 'handles'"),
        ({"zzz": 1}, "zzz is not known: the keys are version, preset, method"),
        ({"method": "arapp"}, 'method must be "arap" or "bbw".*, got "arapp"'),
        ({"method": ["arap"]}, "method must be"),
        ({"free_radius": 0}, "free_radius must be a finite number greater than 0, got 0"),
        ({"free_radius": math.inf}, "free_radius must be a finite number"),
        ({"free_radius": 10**400}, "free_radius must be a finite number"),
        ({"free_radius": "1"}, "free_radius must be a finite number"),
        ({"graph": None}, "graph must be an object in braces, got null"),
        ({"graph": {"epsilon": -1}}, "graph.epsilon must be a finite number of at least 0"),
        ({"graph": {"k": 2}}, "graph.k must be a whole number, 3 to 1000"),
        ({"graph": {"k": 30.0}}, "graph.k must be a whole number"),
        ({"graph": {"k": True}}, "graph.k must be a whole number"),
        ({"graph": {"cut": [[1, 1]]}}, r"graph.cut\[0\] must be a pair of different row numbers, got \[1, 1\]"),
        ({"graph": {"add": [[1, 2], [1]]}}, r"graph.add\[1\] must be a pair"),
        ({"graph": {"add": 3}}, "graph.add must be a list"),
        ({"handles": {}}, "handles must be a list of objects"),
        ({"handles": [3]}, r"handles\[0\] must be an object"),
        ({"handles": [BALL, {}]}, r"handles\[1\].center must be a list of 3 finite numbers .*, it is missing"),
        ({"handles": [{"center": [0, 0, 0]}]}, r"handles\[0\].radius must be .* it is missing"),
        ({"handles": [{**BALL, "radius": True}]}, r"handles\[0\].radius must be a finite number .* got true"),
        ({"handles": [{**BALL, "radius": None}]}, r"handles\[0\].radius must be"),
        ({"handles": [{**BALL, "center": [0, 0]}]}, r"handles\[0\].center must be a list of 3"),
        ({"handles": [{**BALL, "center": "abc"}]}, r"handles\[0\].center must be a list of 3"),
        ({"handles": [{**BALL, "center": [0, 0, math.nan]}]}, r"handles\[0\].center must be a list of 3 finite"),
        ({"handles": [{**BALL, "rows": [1]}]}, r"handles\[0\].radius must be left out where rows are given"),
        ({"handles": [{"rows": []}]}, r"handles\[0\].rows must be a list of row numbers with at least one"),
        ({"handles": [{"rows": [1, -1]}]}, r"handles\[0\].rows\[1\] must be a row number, 0 or more, got -1"),
        ({"handles": [{"rows": [1.0]}]}, r"handles\[0\].rows\[0\] must be a row number"),
        ({"handles": [{"rows": [False]}]}, r"handles\[0\].rows\[0\] must be a row number"),
        ({"handles": [{**BALL, "rotate": [0, 0, 0, 0]}]}, r"handles\[0\].rotate must be a quaternion .* not zero"),
        ({"handles": [{**BALL, "rotate": [1, 0, 0]}]}, r"handles\[0\].rotate must be a list of 4"),
        ({"handles": [{**BALL, "rotate": [1e200] * 4, "scale": -1}]}, r"handles\[0\].scale"),
        ({"handles": [{**BALL, "scale": 0}]}, r"handles\[0\].scale must be a number from 1e-06 to"),
        (
            {"handles": [{**BALL, "scale": [1, 1, -1]}]},
            r"handles\[0\].scale must be a number from 1e-06 to",
        ),
        ({"handles": [{**BALL, "scale": None}]}, r"handles\[0\].scale must be"),
        ({"handles": [{**BALL, "scale": [1, 1, 1e7]}]}, r"handles\[0\].scale must be"),
        (
            {"handles": [{**BALL, "translate": [0, 1e39, 0]}]},
            r"handles\[0\].translate must be .* -1e\+30 and 1e\+30",
        ),
        ({"handles": [{**BALL, "translate": [0, -1e300, 0]}]}, r"handles\[0\].translate must be .* between"),
        ({"pins": [{"center": [1e31, 0, 0], "radius": 1}]}, r"pins\[0\].center must be .* between"),
        ({"handles": [{**BALL, "cage_radius": -1}]}, r"handles\[0\].cage_radius must be"),
        ({"handles": [{**BALL, "name": 3}]}, r"handles\[0\].name must be text"),
        ({"handles": [{**BALL, "colour": "red"}]}, r"handles\[0\].colour is not known"),
        ({"pins": [{**BALL, "translate": [0, 0, 1]}]}, r"pins\[0\].translate is not known"),
        ({"solver": {"kind": "fast"}}, 'solver.kind must be "converged" or "local-global" or "libigl"'),
        ({"solver": {"tolerance": 0}}, "solver.tolerance must be a finite number greater than 0"),
        ({"solver": {"iterations": 0}}, "solver.iterations must be a whole number, 1 or more"),
        ({"solver": {"smoothness": -1}}, "solver.smoothness must be a finite number of at least 0"),
        ({"adaptation": "smooth"}, "adaptation must be"),
        ({"hops": 4}, "hops must be a whole number, 1 to 3"),
        ({"blending": "log"}, "blending must be"),
    ],
)
def test_a_wrong_value_is_refused_with_its_path(changed, message):
    with pytest.raises(RecipeError, match=message):
        recipe_from_json({"version": 1, **changed})


@pytest.mark.parametrize("value", [None, [], "recipe", 3])
def test_what_is_no_object_is_refused(value):
    with pytest.raises(RecipeError, match="must be an object in braces"):
        recipe_from_json(value)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "it is not JSON"),
        (b'{"version": 1,}', "it is not JSON: .* in line 1, column"),
        (b"\xff\xfe", "not text in UTF-8"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"version": 1, "method": "arap", "method": "bbw"}', "the key 'method' stands twice"),
        (b'{"version": 1, "free_radius": NaN}', "free_radius must be a finite number"),
    ],
)
def test_a_file_that_is_no_recipe_is_refused_by_its_name(data, message, tmp_path):
    (tmp_path / "edit.json").write_bytes(data)
    with pytest.raises(RecipeError, match=message) as caught:
        read_recipe(tmp_path / "edit.json")
    assert str(caught.value).startswith("edit.json: ")


def test_paths_that_cannot_be_read_or_written_are_refused(tmp_path):
    with pytest.raises(RecipeError, match="cannot be read: No such file"):
        read_recipe(tmp_path / "missing.json")
    with pytest.raises(RecipeError, match="cannot be read: it is a directory"):
        read_recipe(tmp_path)
    with pytest.raises(RecipeError, match="cannot be written"):
        write_recipe(tmp_path / "no" / "edit.json", Edit())


def test_a_recipe_that_could_not_be_read_again_is_not_written(tmp_path):
    with pytest.raises(RecipeError, match=r"handles\[0\].radius"):
        write_recipe(tmp_path / "edit.json", Edit(handles=(Handle("a", (0, 0, 0), -1.0),)))
    assert not (tmp_path / "edit.json").exists()


def test_numpy_numbers_are_written_as_numbers(tmp_path):
    center = tuple(np.array([0.5, 1.5, 2.5], "f4"))
    recipe = Edit(handles=(Handle("a", center, np.float64(2)), Handle("b", rows=tuple(np.arange(3)))))
    write_recipe(tmp_path / "a.json", recipe)
    back = read_recipe(tmp_path / "a.json")
    assert back.handles[0].center == (0.5, 1.5, 2.5)
    assert back.handles[1].rows == (0, 1, 2)


@pytest.mark.parametrize("length", [1.0, 7.0, 1e-3, 1e-200, 1e150])
def test_rotations_are_normalised(length):
    quat = [0.6 * length, 0.0, 0.8 * length, 0.0]
    handle = recipe_from_json({"version": 1, "handles": [{**BALL, "rotate": quat}]}).handles[0]
    np.testing.assert_allclose(handle.rotate, [0.6, 0, 0.8, 0], rtol=1e-15)


def test_a_pose_turns_and_scales_about_the_center():
    half = math.sqrt(0.5)
    pose = Handle("a", (1.0, 2.0, 3.0), 1.0, translate=(10.0, 0, 0), rotate=(half, 0, 0, half), scale=2.0).pose
    T = pose.matrix(np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(T @ [1, 2, 3, 1], [11, 2, 3, 1], atol=1e-12)
    # A quarter turn about z takes x to y.
    np.testing.assert_allclose(T @ [2, 2, 3, 1], [11, 4, 3, 1], atol=1e-12)
    stretched = Pose(rotate=(half, 0, 0, half), scale=(3.0, 1.0, 1.0)).matrix(np.zeros(3))
    np.testing.assert_allclose(stretched @ [1, 0, 0, 1], [0, 3, 0, 1], atol=1e-12)
