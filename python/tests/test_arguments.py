"""What the queries accept, and what they say about what they do not."""

import warnings

import numpy as np
import pytest
from conftest import random_rays

import octray

ARRAYS = ["t", "u", "v", "prim_id", "geom_id", "normal"]


def assert_same(hits, expected):
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(hits, name), getattr(expected, name), err_msg=name)


def strided(array):
    wide = np.zeros((len(array), 7), dtype=array.dtype)
    wide[:, 1:6:2] = array
    return wide[:, 1:6:2]


def read_only(array):
    array = array.copy()
    array.flags.writeable = False
    return array


def unaligned(array):
    raw = np.zeros(array.nbytes + 1, dtype=np.uint8)
    raw[1:] = np.frombuffer(array.tobytes(), dtype=np.uint8)
    return raw[1:].view(array.dtype).reshape(array.shape)


@pytest.mark.parametrize(
    "convert",
    [
        lambda array: array.astype(np.float64),
        lambda array: array.astype(">f4"),
        lambda array: array.tolist(),
        np.asfortranarray,
        strided,
        lambda array: strided(array.astype(np.float64)),
        lambda array: array[::-1].copy()[::-1],
        read_only,
        unaligned,
    ],
)
def test_every_layout_gives_the_same_hits(scene, convert):
    origins, directions = random_rays(3_000)
    expected = scene.intersect(origins, directions)
    assert_same(scene.intersect(convert(origins), convert(directions)), expected)
    occluded = scene.occluded(convert(origins), convert(directions))
    np.testing.assert_array_equal(occluded, expected.hit)


def test_results_have_their_shapes_and_types(scene):
    hits = scene.intersect(*random_rays(1_000))
    for name in ["t", "u", "v"]:
        assert hits[name].shape == (1_000,) and hits[name].dtype == np.float32
    for name in ["prim_id", "geom_id"]:
        assert hits[name].shape == (1_000,) and hits[name].dtype == np.int32
    assert hits.normal.shape == (1_000, 3) and hits.normal.dtype == np.float32
    assert len(hits) == 1_000
    assert list(dict(hits)) == ARRAYS
    assert hits.normal is hits.normal
    assert repr(hits) == f"<octray.Hits: {hits.hit.sum()} of 1000 rays>"
    with pytest.raises(KeyError):
        hits["distance"]


def test_a_miss_is_the_same_in_all_arrays(scene):
    hits = scene.intersect([[9, 9, 9]], [[1, 0, 0]])
    assert hits.t[0] == np.inf and hits.u[0] == hits.v[0] == 0
    assert hits.prim_id[0] == hits.geom_id[0] == -1
    assert hits.normal.tolist() == [[0, 0, 0]]


@pytest.mark.parametrize("row", [lambda row: row, lambda row: row[None]])
def test_one_row_goes_with_all(scene, row):
    origins, directions = random_rays(5_000)
    one = np.broadcast_to(origins[0], origins.shape)
    assert_same(scene.intersect(row(origins[0]), directions), scene.intersect(one, directions))
    one = np.broadcast_to(directions[0], directions.shape)
    assert_same(scene.intersect(origins, row(directions[0])), scene.intersect(origins, one))
    assert len(scene.intersect(row(origins[0]), row(directions[0]))) == 1


@pytest.mark.parametrize("count", [0, 1, 7, 511, 512, 513, 4_095, 4_097, 20_001])
@pytest.mark.parametrize("threads", [1, 0])
def test_any_number_of_rays(scene, count, threads):
    origins, directions = random_rays(count)
    hits = scene.intersect(origins, directions, threads=threads)
    assert len(hits) == count and hits.normal.shape == (count, 3)
    for index in range(0, count, 997):
        one = scene.intersect(origins[index], directions[index])
        assert one.t[0] == hits.t[index] and one.prim_id[0] == hits.prim_id[index]
    np.testing.assert_array_equal(
        scene.occluded(origins, directions, threads=threads), hits.hit
    )


def test_ends_of_rays_may_differ(scene):
    origins, directions = random_rays(10_000)
    first = scene.intersect(origins, directions)
    beyond = np.nextafter(first.t, np.float32(np.inf))
    second = scene.intersect(origins, directions, t_min=beyond)
    assert (second.t >= beyond).all()
    # The mesh is closed: who enters leaves, and who does not hit it does not hit it later.
    assert not second.hit[~first.hit].any()
    before = np.nextafter(first.t, np.float32(0), dtype=np.float32)[first.hit]
    args = origins[first.hit], directions[first.hit]
    assert not scene.occluded(*args, t_max=before).any()
    assert scene.occluded(*args, t_max=first.t[first.hit].astype(np.float64)).all()
    assert scene.occluded(*args, t_max=np.float32(100), t_min=0).all()
    assert scene.occluded(*args, t_max=1e300).all()


def test_rays_that_are_no_rays_miss(scene):
    origins = np.zeros((8, 3), dtype=np.float32)
    directions = np.full((8, 3), 0.5, dtype=np.float32)
    origins[1, 0], origins[2, 1] = np.nan, np.inf
    directions[3, 2], directions[4, 0], directions[5] = np.nan, -np.inf, 0
    t_min = np.array([0, 0, 0, 0, 0, 0, np.nan, 1e9])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hits = scene.intersect(origins, directions, t_min=t_min)
        assert hits.hit.tolist() == [True] + 7 * [False]
        hits = scene.intersect(np.full((1, 3), 1e300), [1.0, 0.0, 0.0])
    assert not hits.hit.any()
    assert not scene.occluded(origins, directions, t_max=np.nan).any()


@pytest.mark.parametrize(
    ("origins", "directions", "said"),
    [
        (np.zeros((10, 3)), np.zeros((9, 3)), ["(10, 3)", "(9, 3)"]),
        (np.zeros((0, 3)), np.zeros((9, 3)), ["(0, 3)", "(9, 3)"]),
        (np.zeros((10, 2)), np.zeros((10, 3)), ["origins", "(10, 2)", "(n, 3)"]),
        (np.zeros((10, 3)), np.zeros(4), ["directions", "(4,)", "(n, 3)"]),
        (np.zeros((2, 5, 3)), np.zeros((10, 3)), ["origins", "(2, 5, 3)"]),
        ([], np.zeros((10, 3)), ["origins", "(0,)"]),
        (1.0, np.zeros((10, 3)), ["origins", "()"]),
    ],
)
def test_shapes_that_do_not_match_are_named(scene, origins, directions, said):
    for query in [scene.intersect, scene.occluded]:
        with pytest.raises(ValueError) as error:
            query(origins, directions)
        for part in said:
            assert part in str(error.value)


def test_ends_that_do_not_match_are_named(scene):
    with pytest.raises(ValueError, match=r"t_max has shape \(4,\) and origins has shape \(5, 3\)"):
        scene.intersect(np.zeros((5, 3)), np.ones(3), t_max=np.ones(4))
    with pytest.raises(ValueError, match=r"t_min has shape \(5, 1\)"):
        scene.occluded(np.zeros((5, 3)), np.ones(3), t_min=np.ones((5, 1)))


def test_what_is_no_number_is_refused(scene):
    for nonsense in ["abc", [["a", "b", "c"]], {"x": 1}, None, [[1, 2], [1, 2, 3]]]:
        with pytest.raises((TypeError, ValueError)):
            scene.intersect(nonsense, [[0, 0, 1]])


def test_hits_that_were_written_to_do_no_harm(scene):
    hits = scene.intersect(*random_rays(100))
    hits.prim_id[:] = 2**31 - 1
    hits.geom_id[50:] = 12
    assert not hits.normal.any()


def test_arrays_of_float32_are_not_copied(scene):
    import tracemalloc

    origins, directions = random_rays(100_000)
    for convert in [np.ascontiguousarray, lambda array: array.astype(np.float64)]:
        args = convert(origins), convert(directions)
        tracemalloc.start()
        occluded = scene.occluded(*args)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 2 * occluded.nbytes
