"""What points see of a light, against `occluded` and the same rays."""

import numpy as np
import pytest

import octray

LIGHT = np.array([[-0.8, 2.0, -0.6], [1.2, 0.1, 0.0], [0.0, 0.2, 1.1]], dtype=np.float32)
END = np.float32(1.0) - np.float32(1.0e-4)


def floor(count, seed=3):
    """Points below the mesh, some of them in its shadow."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-3.0, 3.0, (count, 3)).astype(np.float32)
    points[:, 1] = -1.3
    return points


def by_rays(scene, points, places):
    """The fraction of the samples whose rays hit nothing."""
    corner, edge_u, edge_v = LIGHT
    targets = corner + edge_u * places[..., :1] + edge_v * places[..., 1:]
    directions = (targets - points[:, None]).reshape(-1, 3)
    origins = np.repeat(points, places.shape[1], axis=0)
    hidden = scene.occluded(origins, directions, t_max=END).reshape(places.shape[:2])
    return 1.0 - hidden.mean(axis=1)


@pytest.mark.parametrize("samples", [1, 5, 16, 64])
def test_fractions_are_those_of_the_rays(scene, samples):
    points = floor(3_000)
    places = np.random.default_rng(4).random((len(points), samples, 2), dtype=np.float32)
    seen = scene.visibility(points, LIGHT, places)
    assert seen.dtype == np.float32
    np.testing.assert_allclose(seen, by_rays(scene, points, places), atol=1e-6)
    assert 0.02 < (seen == 0.0).mean() < 0.98
    np.testing.assert_array_equal(seen, scene.visibility(points, LIGHT, places, threads=1))
    wide = [array.astype(np.float64) for array in (points, LIGHT, places)]
    np.testing.assert_array_equal(seen, scene.visibility(*wide))


def test_samples_follow_from_number_and_seed(scene):
    points = floor(2_000)
    seen = scene.visibility(points, LIGHT)
    np.testing.assert_array_equal(seen, scene.visibility(points, LIGHT, 16, None, 0, 1))
    assert (seen != scene.visibility(points, LIGHT, seed=1)).any()
    many = scene.visibility(points, LIGHT, 1024)
    assert abs(seen - many).max() < 0.3
    assert abs((seen - many).mean()) < 0.01


def test_a_point_light_is_seen_or_not(scene):
    points, light = floor(2_000), LIGHT[0]
    seen = scene.visibility(points, light, 1)
    hidden = scene.occluded(points, light - points, t_max=END)
    np.testing.assert_array_equal(seen, 1.0 - hidden)


def test_surfaces_that_face_away_see_nothing(scene):
    points = floor(500)
    up = np.tile(np.array([0.0, 1.0, 0.0], dtype=np.float32), (len(points), 1))
    expected = scene.visibility(points, LIGHT)
    np.testing.assert_array_equal(scene.visibility(points, LIGHT, normals=up), expected)
    assert not scene.visibility(points, LIGHT, normals=-up).any()


def test_no_points_see_nothing(scene):
    assert scene.visibility(np.zeros((0, 3)), LIGHT).shape == (0,)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.zeros((5, 2)), LIGHT), r"points has shape \(5, 2\)"),
        ((floor(5), np.zeros((2, 3))), r"light has shape \(2, 3\)"),
        ((floor(5), LIGHT, 0), "samples is 0"),
        ((floor(5), LIGHT, -3), "samples is -3"),
        ((floor(5), LIGHT, np.zeros((5, 2))), r"samples has shape \(5, 2\)"),
        ((floor(5), LIGHT, np.zeros((4, 7, 2))), r"samples has shape \(4, 7, 2\)"),
        ((floor(5), LIGHT, 16, floor(4)), r"normals has shape \(4, 3\)"),
    ],
)
def test_what_does_not_match_is_named(scene, arguments, message):
    with pytest.raises(ValueError, match=message):
        scene.visibility(*arguments)


def test_an_empty_scene_hides_nothing():
    assert (octray.Scene([]).visibility(floor(40), LIGHT) == 1.0).all()
