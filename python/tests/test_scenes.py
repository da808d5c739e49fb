"""Making scenes: what they accept, refuse, keep and tell."""

import copy
import pickle

import numpy as np
import pytest
from conftest import random_rays

import octray


def test_a_scene_tells_what_it_is(mesh, scene):
    vertices, faces = mesh
    assert len(scene) == len(faces)
    np.testing.assert_array_equal(scene.bounds, [vertices.min(axis=0), vertices.max(axis=0)])
    assert scene.nbytes > vertices.nbytes
    assert scene.dropped == {"degenerate": 0, "not_finite": 0}
    text = f"<octray.Scene: 1 geometry, {len(faces)} triangles, {scene.nbytes / 1e6:.1f} MB>"
    assert repr(scene) == text
    assert octray.__version__.count(".") == 2


@pytest.mark.parametrize("build", ["fast", "balanced", "high"])
def test_every_build_answers_the_same(mesh, scene, build):
    rays = random_rays(2_000)
    for other in (
        octray.Scene.from_mesh(*mesh, build=build),
        octray.Scene([octray.Mesh(*mesh)], build=build),
    ):
        np.testing.assert_array_equal(other.intersect(*rays).t, scene.intersect(*rays).t)


def test_an_unknown_build_is_refused(mesh):
    with pytest.raises(ValueError, match="`slow` is no build: give fast, balanced or high"):
        octray.Scene.from_mesh(*mesh, build="slow")


@pytest.mark.parametrize("dtype", [np.int32, np.uint32, np.int64, np.uint64, np.uint16])
def test_faces_may_be_any_integers(mesh, scene, dtype):
    vertices, faces = mesh
    other = octray.Scene.from_mesh(vertices.astype(np.float64), np.asfortranarray(faces, dtype))
    rays = random_rays(2_000)
    np.testing.assert_array_equal(other.intersect(*rays).t, scene.intersect(*rays).t)


def test_a_mesh_may_come_as_loose_triangles(mesh, scene):
    vertices, faces = mesh
    rays = random_rays(2_000)
    loose = octray.Scene.from_mesh(vertices[faces])
    np.testing.assert_array_equal(loose.intersect(*rays).prim_id, scene.intersect(*rays).prim_id)


def test_a_scene_does_not_change_with_the_arrays_it_was_made_from(mesh):
    vertices, faces = (array.copy() for array in mesh)
    scene = octray.Scene.from_mesh(vertices, faces)
    rays = random_rays(1_000)
    before = scene.intersect(*rays)
    vertices[:] = 0
    faces[:] = 0
    after = pickle.loads(pickle.dumps(scene)).intersect(*rays)
    np.testing.assert_array_equal(after.t, before.t)
    with pytest.raises(ValueError):
        scene.geometries[0].vertices[0] = 1


def test_an_empty_scene_is_hit_by_nothing():
    for scene in [octray.Scene([]), octray.Scene.from_mesh(np.zeros((0, 3)), np.zeros((0, 3)))]:
        assert len(scene) == 0 and not scene
        assert not scene.occluded(*random_rays(100)).any()
        assert scene.bounds.tolist() == [3 * [np.inf], 3 * [-np.inf]]


def test_triangles_that_no_ray_can_hit_are_counted():
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0]]
    scene = octray.Scene.from_mesh(vertices, [[0, 0, 1], [0, 1, 3], [0, 1, 2]])
    assert scene.dropped == {"degenerate": 1, "not_finite": 1}
    assert scene.intersect([[0.2, 0.2, 1]], [[0, 0, -1]]).prim_id.tolist() == [2]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: octray.Scene.from_mesh(np.zeros((4, 2)), [[0, 1, 2]]), "(4, 2)"),
        (lambda: octray.Scene.from_mesh(np.zeros((4, 3)), [[0, 1, 2, 3]]), "(1, 4)"),
        (lambda: octray.Scene.from_mesh(np.zeros((4, 3)), [0, 1, 2]), "(3,)"),
        (lambda: octray.Scene.from_mesh(np.zeros((4, 3))), "(4, 3)"),
        (lambda: octray.Scene.from_mesh(np.eye(3), [[0, 1, 3]]), "names vertex 3"),
        (lambda: octray.Scene.from_mesh(np.eye(3), [[0, 1, 2], [0, -1, 2]]), "face 1 names vertex -1"),
        (lambda: octray.Scene.from_mesh(np.eye(3), [[0, 1, 2**40]]), str(2**40)),
        (lambda: octray.Scene.from_spheres(np.zeros((2, 3)), [1, -1]), "sphere 1 of geometry 0"),
        (lambda: octray.Scene.from_spheres(np.zeros((2, 3)), [1, 1, 1]), "(3,)"),
        (lambda: octray.Scene.from_spheres([[np.nan, 0, 0]], [1]), "sphere 0"),
        (lambda: octray.Scene.from_quads([[0, 0, 0]], [[1, 0, 0]], [[2, 0, 0]]), "quad 0"),
        (lambda: octray.Scene.from_quads(np.zeros((2, 3)), np.eye(3), np.eye(3)), "(2, 3)"),
    ],
)
def test_wrong_geometry_is_named(make, said):
    with pytest.raises(ValueError) as error:
        make()
    assert said in str(error.value)


def test_wrong_types_are_named():
    with pytest.raises(TypeError, match="float64"):
        octray.Scene.from_mesh(np.eye(3), [[0.0, 1.0, 2.0]])
    with pytest.raises(TypeError, match="str"):
        octray.Scene(["mesh"])
    with pytest.raises(TypeError):
        octray.Scene(5)


def test_everything_can_be_pickled_and_copied(mesh):
    ball = octray.Spheres([[0, 0, 2]], 0.5)
    quad = octray.Quads([[-1, -1, 0]], [[2, 0, 0]], [[0, 2, 0]])
    scene = octray.Scene([octray.Mesh(*mesh), ball, quad])
    rays = random_rays(5_000)
    hits = scene.intersect(*rays)
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps((scene, hits, ball, quad), protocol))
        assert repr(again[0]) == repr(scene)
        for other in [again[0].intersect(*rays), again[1], copy.copy(hits)]:
            for name in hits.keys():
                np.testing.assert_array_equal(other[name], hits[name])
        assert again[2].centers.tolist() == [[0, 0, 2]]
        assert again[3].edges_v.tolist() == [[0, 2, 0]]
