"""Hits against other answers: a brute force in doubles, Embree, and formulas."""

import numpy as np
import pytest
from conftest import brute_force, random_rays

import octray


def test_closest_hits_are_those_of_a_brute_force_in_doubles(mesh, scene):
    origins, directions = random_rays(600)
    expected, margin = brute_force(*mesh, origins, directions)
    hits = scene.intersect(origins, directions)
    clear = margin > 1e-5
    assert clear.mean() > 0.98
    assert np.isfinite(expected).sum() > 200
    np.testing.assert_array_equal(hits.hit[clear], np.isfinite(expected[clear]))
    both = hits.hit & np.isfinite(expected)
    np.testing.assert_allclose(hits.t[both], expected[both], rtol=1e-5, atol=1e-6)


def test_hits_agree_with_embree(mesh, scene):
    mesh_construction = pytest.importorskip("embreex.mesh_construction")
    rtcore_scene = pytest.importorskip("embreex.rtcore_scene")
    vertices, faces = mesh
    embree = rtcore_scene.EmbreeScene()
    # Bound to a name: the scene does not keep it alive.
    embree_mesh = mesh_construction.TriangleMesh(embree, vertices, faces.astype(np.int32))
    origins, directions = random_rays(100_000)
    theirs = embree.run(origins, directions, output=1)
    occluded = embree.run(origins, directions, query="OCCLUDED") == 0
    del embree_mesh
    ours = scene.intersect(origins, directions)
    hit = theirs["primID"] >= 0
    # A ray that grazes an edge may differ.
    assert (hit != ours.hit).sum() <= 5
    assert (occluded != scene.occluded(origins, directions)).sum() <= 5
    both = hit & ours.hit
    assert both.sum() > 30_000
    same = both & (theirs["primID"] == ours.prim_id)
    assert same.sum() >= both.sum() - 20
    np.testing.assert_allclose(ours.t[both], theirs["tfar"][both], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(ours.u[same], theirs["u"][same], atol=1e-3)
    np.testing.assert_allclose(ours.v[same], theirs["v"][same], atol=1e-3)
    normal = theirs["Ng"] / np.linalg.norm(theirs["Ng"], axis=1, keepdims=True)
    np.testing.assert_allclose(ours.normal[same], normal[same], atol=1e-3)


def test_surface_coordinates_and_normals_of_a_mesh_give_the_point_hit(mesh, scene):
    vertices, faces = mesh
    origins, directions = random_rays(5_000)
    hits = scene.intersect(origins, directions)
    corners = vertices[faces[hits.prim_id[hits.hit]]].astype(np.float64)
    u, v = hits.u[hits.hit, None], hits.v[hits.hit, None]
    on_mesh = (1.0 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    on_ray = (origins + hits.t[:, None] * directions)[hits.hit]
    np.testing.assert_allclose(on_mesh, on_ray, atol=1e-5)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(hits.normal[hits.hit], normal, atol=1e-6)
    assert not hits.normal[~hits.hit].any()


def test_spheres_are_hit_where_the_formula_says():
    rng = np.random.default_rng(3)
    centers = rng.uniform(-3.0, 3.0, (200, 3))
    radii = rng.uniform(0.1, 0.4, 200)
    scene = octray.Scene.from_spheres(centers, radii)
    origins, directions = random_rays(2_000, spread=4.0)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hits = scene.intersect(origins, directions)
    offset = origins[:, None].astype(np.float64) - centers.astype(np.float32)
    b = np.einsum("nsk,nk->ns", offset, directions.astype(np.float64))
    c = (offset**2).sum(axis=2) - radii.astype(np.float32).astype(np.float64) ** 2
    root = b * b - c
    with np.errstate(invalid="ignore"):
        roots = np.stack([-b - np.sqrt(root), -b + np.sqrt(root)])
    roots[~(roots >= 0.0)] = np.inf
    expected = roots.min(axis=(0, 2))
    assert hits.hit.sum() > 500
    clear = np.abs(root).min(axis=1) > 1e-4
    np.testing.assert_array_equal(hits.hit[clear], np.isfinite(expected)[clear])
    both = hits.hit & np.isfinite(expected)
    np.testing.assert_allclose(hits.t[both], expected[both], rtol=1e-4, atol=1e-4)
    outwards = (origins + hits.t[:, None] * directions)[both] - centers[hits.prim_id[both]]
    outwards /= radii[hits.prim_id[both], None]
    np.testing.assert_allclose(hits.normal[both], outwards, atol=1e-3)


def test_quads_have_coordinates_along_their_edges():
    scene = octray.Scene.from_quads([[0, 0, 0]], [[2, 0, 0]], [[0, 4, 0]])
    hits = scene.intersect([[0.5, 3.0, 5.0], [2.5, 1.0, 5.0]], [0, 0, -1])
    assert hits.t.tolist() == [5.0, np.inf]
    assert (hits.u[0], hits.v[0]) == (0.25, 0.75)
    assert hits.normal.tolist() == [[0, 0, 1], [0, 0, 0]]


def test_geometries_are_numbered_in_order():
    quad = octray.Quads([[-1, -1, 0]], [[2, 0, 0]], [[0, 2, 0]])
    ball = octray.Spheres([[0, 0, 2], [5, 0, 0]], 0.5)
    triangle = octray.Mesh([[4, -1, 9], [6, -1, 9], [5, 1, 9]], [[0, 1, 2]])
    scene = octray.Scene([quad, ball, triangle])
    hits = scene.intersect([[0, 0, 9], [0.9, 0, 9], [5, 0, 10], [5, 0, 8], [9, 9, 9]], [0, 0, -1])
    assert hits.geom_id.tolist() == [1, 0, 2, 1, -1]
    assert hits.prim_id.tolist() == [0, 0, 0, 1, -1]
    assert len(scene) == 4
    assert [len(geometry) for geometry in scene.geometries] == [1, 2, 1]


def test_any_hit_is_closest_hit(scene):
    origins, directions = random_rays(50_000)
    hits = scene.intersect(origins, directions, t_min=0.1, t_max=0.7)
    occluded = scene.occluded(origins, directions, t_min=0.1, t_max=0.7)
    assert occluded.dtype == bool
    np.testing.assert_array_equal(occluded, hits.hit)
    assert 0 < occluded.sum() < len(occluded)
    assert hits.t[hits.hit].min() >= np.float32(0.1)
    assert hits.t[hits.hit].max() <= np.float32(0.7)
