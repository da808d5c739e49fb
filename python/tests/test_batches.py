"""Large batches: rays in no order, results in memory that was used before, normals by the million."""

import numpy as np
import pytest

import octray

COUNT = 450_000


@pytest.fixture(scope="module")
def camera():
    """Rays from one point, row by row."""
    x, y = np.meshgrid(np.linspace(-0.4, 0.4, 750), np.linspace(-0.3, 0.3, 600))
    directions = np.stack([x.ravel(), y.ravel(), np.full(COUNT, -1.0)], axis=1)
    return np.array([0.1, 0.2, 4.0]), directions


def assert_same(hits, expected, order=slice(None)):
    for name in hits.keys():
        np.testing.assert_array_equal(hits[name], expected[name][order], err_msg=name)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("rows", [1, COUNT])
def test_shuffled_rays_get_their_own_answers(scene, camera, threads, kind, rows):
    origin, directions = camera
    order = np.random.default_rng(7).permutation(COUNT)
    # Numbers that are no floats: both kinds are rounded to the same.
    origins = np.broadcast_to(origin, (rows, 3)).astype(np.float32).astype(kind)
    expected = scene.intersect(origin.astype(np.float32), directions.astype(np.float32))
    assert 0.05 < expected.hit.mean() < 0.95
    shuffled = np.ascontiguousarray(directions[order].astype(kind))
    assert_same(scene.intersect(origins, shuffled, threads=threads), expected, order)
    occluded = scene.occluded(origins, shuffled, threads=threads)
    np.testing.assert_array_equal(occluded, expected.hit[order])


def test_ends_of_shuffled_rays_stay_with_them(scene, camera):
    origin, directions = camera
    t_max = np.linspace(2.0, 5.0, COUNT)
    order = np.random.default_rng(8).permutation(COUNT)
    expected = scene.intersect(origin, directions, 0.5, t_max)
    assert expected.hit.sum() < scene.intersect(origin, directions).hit.sum()
    assert_same(scene.intersect(origin, directions[order], 0.5, t_max[order]), expected, order)


def test_results_keep_their_values_while_others_are_made(scene, camera):
    origin, directions = camera
    hits = scene.intersect(origin, directions)
    values = {name: hits[name].copy() for name in hits.keys()}
    part, whole = hits.t[70_000:70_100], hits.prim_id
    ids = whole.copy()
    for _ in range(3):
        assert_same(hits, values)
        scene.intersect(origin, -directions)
        scene.visibility(directions, origin, samples=1)
    del hits
    for _ in range(3):
        scene.intersect(origin, -directions).normal.fill(3.0)
    np.testing.assert_array_equal(part, values["t"][70_000:70_100])
    np.testing.assert_array_equal(whole, ids)


def test_arrays_of_results_are_ordinary_ones(scene, camera):
    hits = scene.intersect(*camera)
    for name in hits.keys():
        array = hits[name]
        assert array.flags.writeable and array.flags.aligned and array.flags.c_contiguous
        array += 1
    assert hits.t.min() > 1.0


def test_normals_of_many_hits_are_those_of_few(mesh, camera):
    vertices, faces = mesh
    corner = [[-2.0, -2.0, -3.0]], [[4.0, 0.0, 0.0]], [[0.0, 4.0, 0.0]]
    scene = octray.Scene([octray.Mesh(vertices, faces), octray.Quads(*corner)])
    origin, directions = camera
    some = slice(200_000, 200_000 + len(scene) // 2)
    before = scene.nbytes
    few = scene.intersect(origin, directions[some]).normal
    assert scene.nbytes == before
    hits = scene.intersect(origin, directions)
    assert set(np.unique(hits.geom_id)) == {-1, 0, 1}
    np.testing.assert_array_equal(hits.normal[some], few)
    assert scene.nbytes == before + 12 * len(scene)
    np.testing.assert_array_equal(scene.intersect(origin, directions[some]).normal, few)
    corners = vertices[faces[hits.prim_id[hits.geom_id == 0]]].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(hits.normal[hits.geom_id == 0], normal, atol=1e-6)
    assert (hits.normal[hits.geom_id == 1] == [0, 0, 1]).all()
    assert not hits.normal[hits.geom_id == -1].any()


@pytest.mark.parametrize("count", [10, COUNT])
def test_ids_that_were_written_to_have_no_normals(mesh, camera, count):
    scene = octray.Scene.from_mesh(*mesh)
    origin, directions = camera
    hits = scene.intersect(origin, directions[:count])
    hits.prim_id[:4] = [len(scene), -1, 2**31 - 1, -(2**31)]
    hits.geom_id[:8] = [0, 0, 0, 0, 1, 2, 2**31 - 1, -(2**31)]
    assert not hits.normal[:8].any()
