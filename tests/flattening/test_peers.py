from __future__ import annotations

import sys

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.flattening.peers import PEERS, _flattened, as_mesh, lscm_places
from deskew.types import Sheet, Status
from tests.flattening.bent_meshes import arch, error_mm, folded_mesh
from tests.flattening.bent_sheets import mirror_folds, rigid_error


@pytest.fixture
def igl() -> None:
    pytest.importorskip("igl", reason="libigl is an extra")


@pytest.mark.usefixtures("igl")
@pytest.mark.parametrize("name", PEERS)
def test_peers_develop_an_arch(name: str) -> None:
    vertices, faces, flat = arch()
    found = PEERS[name](Sheet(vertices, faces))
    assert found.status is Status.AT_REST
    assert 0 < error_mm(found.vertices, flat).max() < 0.05
    assert not found.vertices[:, 2].any()


@pytest.mark.usefixtures("igl")
@pytest.mark.parametrize("name", PEERS)
def test_peers_take_grids_and_keep_their_shape_and_place(name: str) -> None:
    grid, flat = mirror_folds(3, (20, 24))
    found = PEERS[name](Sheet(grid))
    assert found.vertices.shape == grid.shape
    assert 0.01 < rigid_error(found.vertices[..., :2], flat).mean() < 0.5
    np.testing.assert_allclose(found.vertices[..., :2].mean(axis=(0, 1)), grid[..., :2].mean(axis=(0, 1)), atol=1e-9)


@pytest.mark.usefixtures("igl")
@pytest.mark.parametrize("name", PEERS)
def test_peers_are_given_what_is_healed(name: str) -> None:
    """libigl answers coincident vertices with NaN, and ends the process at a vertex without a face."""
    vertices, faces, _ = folded_mesh(12)
    vertices[30] = vertices[31]
    found = PEERS[name](Sheet(np.concatenate([vertices, [[1e6, 0.0, 0.0]]]), faces))
    assert found.status is Status.AT_REST
    assert (found.counters["healed_vertices"], found.counters["healed_faces"]) == (2, 2)
    assert np.array_equal(found.vertices[30], found.vertices[31])
    assert np.ptp(found.vertices[:, :2], axis=0).max() < 2 * np.ptp(vertices, axis=0).max()


@pytest.mark.usefixtures("igl")
@pytest.mark.parametrize("name", PEERS)
def test_peers_keep_the_shape_of_a_cut_grid_with_a_vertex_of_no_quad(name: str) -> None:
    grid, _ = mirror_folds(3, (6, 7))
    cut = np.zeros((5, 6), dtype=bool)
    cut[0, 0] = True
    found = PEERS[name](Sheet(grid, cut=cut))
    assert (found.status, found.vertices.shape) == (Status.AT_REST, grid.shape)
    cut[:, 3] = True
    with pytest.raises(InputError, match="`faces` must be one piece, got 2 pieces"):
        PEERS[name](Sheet(grid, cut=cut))


@pytest.mark.usefixtures("igl")
@pytest.mark.parametrize("name", PEERS)
def test_faces_without_area_make_peers_diverge_and_say_so(name: str) -> None:
    vertices, faces, _ = folded_mesh(12)
    vertices[::3] = vertices[0]
    found = PEERS[name](Sheet(vertices, faces))
    assert found.status is Status.DIVERGED
    assert "zero-area" in found.remedy


@pytest.mark.usefixtures("igl")
@pytest.mark.parametrize("name", PEERS)
def test_peers_refuse_a_mesh_on_a_line(name: str) -> None:
    """On which libigl writes beyond its memory."""
    vertices, faces, _ = folded_mesh(12)
    with pytest.raises(InputError, match="`vertices` must span an area, got faces without area only"):
        PEERS[name](Sheet(vertices * [1.0, 0.0, 0.0], faces))


@pytest.mark.usefixtures("igl")
def test_libigl_failing_is_a_failed_step() -> None:
    vertices, faces, _ = folded_mesh(12)
    with pytest.raises(StepError, match=r"Flattening by libigl failed: RuntimeError: .*; use method `spring`\.$"):
        _flattened(Sheet(vertices, faces), lambda v, f: lscm_places(np.vstack([v, v]), np.vstack([f, f + len(v)])), 1)


def test_cut_quads_are_left_out_of_the_mesh() -> None:
    grid, _ = mirror_folds(3, (6, 7))
    cut = np.zeros((5, 6), dtype=bool)
    cut[2, 3] = True
    assert len(as_mesh(Sheet(grid, cut=cut))[1]) == len(as_mesh(Sheet(grid))[1]) - 2


@pytest.mark.parametrize("name", PEERS)
def test_missing_libigl_is_one_clear_line(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "igl", None)
    with pytest.raises(InputError, match=r"pip install 'deskew3d\[peers\]'"):
        PEERS[name](Sheet(*folded_mesh(5)[:2]))
