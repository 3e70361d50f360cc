"""A scene whose faint splats follow: the window's worker goes the way there and back."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.engine.quantities import QUANTITIES
from splap_editor.io.sample_maker import HAZE, shape_sample, write_sample
from splap_editor.session.bound_edit import snapshot_of
from splap_editor.session.graph_preview import GraphPreview
from splap_editor.session.session import Session
from tests.session.test_session import bent


@pytest.fixture
def session(main, tmp_path):
    write_sample(tmp_path / "hazy.ply", shape_sample("tube", 3000, HAZE).splats)
    session = Session(main.post)
    session.failures = []
    session.failed.connect(lambda title, error: session.failures.append(str(error)))
    session.open(tmp_path / "hazy.ply")
    main.run_until(lambda: session.state == "ready")
    yield session
    session.close()


def test_faint_splats_follow_a_bent_surface_and_undo_takes_them_back(main, session):
    bent(main, session)
    scene = session.scene
    n_visible = scene.visible.n_nodes
    faint = scene.splats.opacities < 0.1
    assert scene.ellipses.n_nodes == np.count_nonzero(~faint)
    options = replace(scene.edit.graph, carriers="all")
    session.steps.change_edit(scene.edit.with_options(options), "Change graph")
    main.run_until(lambda: session.state == "settled" and scene.surface.options.carriers == "all")
    assert scene.ellipses.n_nodes == n_visible
    options = replace(scene.edit.graph, carriers="solid")
    session.steps.change_edit(scene.edit.with_options(options), "Change graph")
    main.run_until(lambda: session.state == "settled" and scene.surface.options.carriers == "solid")
    assert scene.ellipses is scene.surface.ellipses and scene.ellipses.n_nodes == np.count_nonzero(~faint)
    assert scene.visible.n_nodes == n_visible
    moved = np.linalg.norm(scene.positions - scene.splats.means, axis=1)
    # The handle takes an end along with the haze about it, and the pinned end stays with its own.
    assert moved[faint].max() > 0.2 and np.mean(moved[faint] < 1e-6) > 0.01
    snapshot = snapshot_of(scene, session.bound)
    for name in ("degree", "component", "stretch", "contribution", "free"):
        values = QUANTITIES[name].values(snapshot)
        assert values.shape == (scene.splats.n_splats,) and np.isfinite(values[~faint]).all()
    session.history.undo()
    main.run_until(lambda: session.state == "settled" and scene.surface.options.carriers == "all")
    assert scene.ellipses.n_nodes == n_visible and session.failures == []


def test_a_previewed_graph_goes_with_the_nodes_it_is_of(main, session):
    bent(main, session)
    scene, preview = session.scene, GraphPreview(session)
    options = replace(scene.edit.graph, epsilon=0.01)
    preview.ask(options)
    main.run_until(lambda: preview.graph is not None)
    assert preview.graph.n_nodes == scene.ellipses.n_nodes
    session.steps.change_edit(scene.edit.with_options(replace(scene.edit.graph, carriers="all")), "Change graph")
    main.run_until(lambda: session.state == "settled" and scene.surface.options.carriers == "all")
    assert preview.graph is None and preview.wanted is None
    preview.ask(options)
    main.run_until(lambda: preview.graph is not None)
    assert preview.graph.n_nodes == scene.ellipses.n_nodes
