"""What the tests share: meshes, rays and a brute force in double precision."""

import numpy as np
import pytest

SEED = 7


def bumpy_sphere(rows=40, columns=80):
    """A closed mesh of a sphere with bumps: 2 * columns * (rows - 1) triangles."""
    theta = np.linspace(0.0, np.pi, rows + 1)[1:-1]
    phi = np.arange(columns) * (2.0 * np.pi / columns)
    theta, phi = (grid.ravel() for grid in np.meshgrid(theta, phi, indexing="ij"))
    radius = 1.0 + 0.2 * np.sin(3.0 * theta) * np.cos(5.0 * phi)
    points = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], 1)
    points *= radius[:, None]
    vertices = np.concatenate([points, [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]])
    top, bottom = len(points), len(points) + 1
    faces = []
    for column in range(columns):
        after = (column + 1) % columns
        faces.append([top, after, column])
        last = (rows - 2) * columns
        faces.append([bottom, last + column, last + after])
        for row in range(rows - 2):
            a, b = row * columns + column, row * columns + after
            c, d = a + columns, b + columns
            faces += [[a, b, c], [b, d, c]]
    return vertices.astype(np.float32), np.array(faces, dtype=np.int64)


def random_rays(count, seed=SEED, spread=2.0):
    """Rays from a box around the origin towards points near it."""
    rng = np.random.default_rng(seed)
    origins = rng.uniform(-spread, spread, (count, 3)).astype(np.float32)
    directions = (rng.normal(0.0, 0.5, (count, 3)) - origins).astype(np.float32)
    return origins, directions


def brute_force(vertices, faces, origins, directions):
    """t of the closest hit of each ray by Moeller and Trumbore's test in doubles; inf for none.

    Also how far each ray is from changing its mind: the least distance from an edge, over all
    triangles in whose plane's front it passes, in barycentric coordinates.
    """
    a, b, c = (vertices.astype(np.float64)[faces[:, corner]] for corner in range(3))
    edge_u, edge_v = b - a, c - a
    t_of, margin_of = [], []
    for origin, direction in zip(origins.astype(np.float64), directions.astype(np.float64)):
        p = np.cross(direction, edge_v)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / np.einsum("ij,ij->i", edge_u, p)
            offset = origin - a
            u = np.einsum("ij,ij->i", offset, p) * inverse
            q = np.cross(offset, edge_u)
            v = q @ direction * inverse
            t = np.einsum("ij,ij->i", edge_v, q) * inverse
        inside = np.minimum(np.minimum(u, v), 1.0 - u - v)
        inside[~np.isfinite(inside) | (t < 0.0)] = -np.inf
        t_of.append(np.min(t[inside >= 0.0], initial=np.inf))
        margin_of.append(np.min(np.abs(inside)))
    return np.array(t_of), np.array(margin_of)


@pytest.fixture(scope="session")
def mesh():
    """Vertices and faces of a closed mesh."""
    return bumpy_sphere()


@pytest.fixture(scope="session")
def scene(mesh):
    """The scene of that mesh."""
    import octray

    return octray.Scene.from_mesh(*mesh)
