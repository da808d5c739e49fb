"""Ray tracing on batches of rays, as NumPy arrays."""

from collections.abc import Callable, Iterable
from os import PathLike
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Hits",
    "Mesh",
    "Quads",
    "Scene",
    "Spheres",
    "__version__",
    "instruction_sets",
    "render",
]

__version__: str

_Build: TypeAlias = Literal["fast", "balanced", "high"]

def instruction_sets() -> dict[str, list[str]]:
    """The vector instruction sets that this build uses (`build`), and the CPU has (`cpu`)."""

def render(
    scene_file: str | PathLike[str],
    *,
    width: int | None = None,
    height: int | None = None,
    spp: int | None = None,
    shadow_samples: int | None = None,
    max_bounces: int | None = None,
    seed: int | None = None,
    threads: int = 0,
    progress: Callable[[int, int], object] | None = None,
) -> NDArray[np.float32]:
    """Renders a scene file (.toml), or a mesh alone (.obj, .ply), to linear RGB.

    The array is (height, width, 3), rows from the top. What is None is as the file says. threads
    is 0 or -1 for all cores, or the most to use; the picture is the same for every number.
    ``progress(done, total)`` is called now and then with counts of tiles; what it raises ends the
    rendering, as Ctrl-C does.
    """

@final
class Mesh:
    """Triangles that share vertices.

    ``vertices`` has the shape (n, 3) and ``faces``, which counts vertices from 0, (m, 3). Without
    faces, the vertices may have the shape (m, 3, 3): the three corners of each triangle.
    """

    def __new__(cls, vertices: ArrayLike, faces: ArrayLike | None = None) -> Mesh: ...
    @property
    def vertices(self) -> NDArray[np.float32]:
        """The positions, (n, 3), a read-only copy."""
    @property
    def faces(self) -> NDArray[np.uint32]:
        """The vertices of each triangle, (m, 3), a read-only copy."""
    def __len__(self) -> int:
        """How many triangles there are."""

@final
class Spheres:
    """Spheres: centres of the shape (n, 3), and n radii above zero, or one for all of them."""

    def __new__(cls, centers: ArrayLike, radii: ArrayLike) -> Spheres: ...
    @property
    def centers(self) -> NDArray[np.float32]:
        """The centres, (n, 3), a read-only copy."""
    @property
    def radii(self) -> NDArray[np.float32]:
        """The radii, (n,), a read-only copy."""
    def __len__(self) -> int:
        """How many spheres there are."""

@final
class Quads:
    """Parallelograms: a corner and the two edges that start there, each of the shape (n, 3)."""

    def __new__(cls, corners: ArrayLike, edges_u: ArrayLike, edges_v: ArrayLike) -> Quads: ...
    @property
    def corners(self) -> NDArray[np.float32]:
        """The corners where u = v = 0, (n, 3), a read-only copy."""
    @property
    def edges_u(self) -> NDArray[np.float32]:
        """The edges along u, (n, 3), a read-only copy."""
    @property
    def edges_v(self) -> NDArray[np.float32]:
        """The edges along v, (n, 3), a read-only copy."""
    def __len__(self) -> int:
        """How many quads there are."""

@final
class Hits:
    """The closest hits of a batch of rays: one array a value, one entry a ray.

    A ray that hit nothing has t = inf, u = v = 0, both ids -1 and a normal of zeros.
    ``dict(hits)`` and ``numpy.savez(file, **hits)`` take all arrays by their names.
    """

    def __new__(
        cls,
        t: NDArray[np.float32],
        u: NDArray[np.float32],
        v: NDArray[np.float32],
        prim_id: NDArray[np.int32],
        geom_id: NDArray[np.int32],
        normal: NDArray[np.float32],
    ) -> Hits: ...
    @property
    def t(self) -> NDArray[np.float32]:
        """Distances in lengths of the rays' directions, (n,)."""
    @property
    def u(self) -> NDArray[np.float32]:
        """First surface coordinates, (n,).

        Triangles: the weight of the second vertex; quads: along edges_u; spheres: 0.
        """
    @property
    def v(self) -> NDArray[np.float32]:
        """Second surface coordinates, (n,).

        Triangles: the weight of the third vertex; quads: along edges_v; spheres: 0.
        """
    @property
    def prim_id(self) -> NDArray[np.int32]:
        """Which primitive of its geometry, (n,)."""
    @property
    def geom_id(self) -> NDArray[np.int32]:
        """Which geometry of the scene, (n,)."""
    @property
    def normal(self) -> NDArray[np.float32]:
        """Unit geometric normals, (n, 3), not turned towards the rays.

        Triangles: (v1 - v0) x (v2 - v0); quads: edges_u x edges_v; spheres: outwards. In a scene
        without spheres they are computed when they are first asked for.
        """
    @property
    def hit(self) -> NDArray[np.bool_]:
        """Which rays hit anything, (n,)."""
    def keys(self) -> list[str]:
        """The names of the arrays."""
    def __getitem__(self, name: str, /) -> NDArray[Any]: ...
    def __len__(self) -> int:
        """How many rays there were."""

@final
class Scene:
    """Geometry that rays can be traced against.

    Immutable: any number of Python threads may use it. ``geom_id`` counts the geometries from 0.
    ``build`` says how much work goes into the tree; the answers are the same.
    """

    def __new__(
        cls, geometries: Iterable[Mesh | Spheres | Quads], *, build: _Build = "balanced"
    ) -> Scene: ...
    @staticmethod
    def from_mesh(
        vertices: ArrayLike, faces: ArrayLike | None = None, *, build: _Build = "balanced"
    ) -> Scene:
        """The scene of one mesh: see `Mesh`."""
    @staticmethod
    def from_spheres(
        centers: ArrayLike, radii: ArrayLike, *, build: _Build = "balanced"
    ) -> Scene:
        """The scene of these spheres: see `Spheres`."""
    @staticmethod
    def from_quads(
        corners: ArrayLike,
        edges_u: ArrayLike,
        edges_v: ArrayLike,
        *,
        build: _Build = "balanced",
    ) -> Scene:
        """The scene of these parallelograms: see `Quads`."""
    def intersect(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = ...,
        threads: int = 0,
    ) -> Hits:
        """The closest hit of each ray, the points origin + t * direction, t_min <= t <= t_max.

        origins and directions have the shape (n, 3), or are one row for all rays; directions need
        not be of unit length. t_min and t_max are one number or have the shape (n,). threads is 0
        or -1 for all cores, or the most to use. Of hits at one t the one with the smallest
        (geom_id, prim_id) counts; the result is the same for every number of threads. A ray with a
        NaN, an infinite origin or direction, a direction of zero or t_min > t_max hits nothing.
        """
    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = ...,
        threads: int = 0,
    ) -> NDArray[np.bool_]:
        """Whether each ray hits anything, (n,). Takes what `intersect` takes."""
    def visibility(
        self,
        points: ArrayLike,
        light: ArrayLike,
        samples: ArrayLike = 16,
        normals: ArrayLike | None = None,
        seed: int = 0,
        threads: int = 0,
    ) -> NDArray[np.float32]:
        """The fraction of a light that each point sees, (n,).

        points has the shape (n, 3) and lies off the surfaces. light is a point, (3,), or a corner
        and two edges of a parallelogram, (3, 3). samples says how many points of the light each
        point looks at, in stratified sets that follow from the point's number and seed; or it is an
        array (n, s, 2) of places along the edges, from 0 to 1. With normals, (n, 3), samples behind
        the surface are not seen. A sample is seen exactly if `occluded` is false for the ray from
        the point to it, t from 0 to 1 - 1e-4.
        """
    @property
    def geometries(self) -> list[Mesh | Spheres | Quads]:
        """What the scene was made of, in the order of geom_id."""
    @property
    def bounds(self) -> NDArray[np.float32]:
        """The corners of the box around everything, (2, 3).

        An empty scene has inf in the first row and -inf in the second.
        """
    @property
    def dropped(self) -> dict[str, int]:
        """How many triangles no ray can hit: ``degenerate`` and ``not_finite``."""
    @property
    def nbytes(self) -> int:
        """The memory of the scene in bytes, `geometries` and normals that are kept included."""
    def __len__(self) -> int:
        """How many primitives were given, dropped ones included."""
