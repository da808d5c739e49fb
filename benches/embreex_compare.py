#!/usr/bin/env python3
# /// script
# requires-python = ">=3.11"
# dependencies = [
#     "embreex==4.4.0",
#     "matplotlib==3.11.2",
#     "numpy==2.4.6",
#     "trimesh==5.2.0",
# ]
# ///
"""The same NumPy rays to octray and to embreex, on any mesh: agreement first, then rays a second.

    python benches/embreex_compare.py [MESH] [--json OUT.json] [--plot OUT.svg]

MESH is any file that trimesh loads; without one the script makes a bumpy sphere. Install octray
first (`pip install ./python`), and what the header of this file lists; or let uv do both:
`uv run --with ./python benches/embreex_compare.py`.

The workloads are those of the native comparison: a pinhole camera in front of the mesh on a ground
of two triangles (primary), one cosine-distributed bounce from each point that it sees (diffuse),
and the same rays in random order (shuffled). embreex traces ray by ray on one thread; it has no
other way. Both libraries are called in turns within one process, and a ratio is the median of the
ratios of the turns. Nothing is timed whose hits were not compared before, and where they differ by
more than grazing rays explain, the script says so and ends.
"""

import argparse
import datetime
import json
import os
import platform
import statistics
import sys
import time

try:
    import numpy as np
    import trimesh
    from embreex import rtcore, rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    import octray
except ImportError as error:
    sys.exit(f"{error}: pip install ./python, and what the header of this script lists")

# The share of rays that may differ: those that graze an edge, or meet two surfaces at one t.
MAX_DIFFERING = 1e-3
# By how much t may differ where both hit, relative to the diagonal of the scene.
T_TOLERANCE = 1e-4


def bumpy_sphere():
    """A mesh of 81,920 triangles with shallow and steep parts."""
    mesh = trimesh.creation.icosphere(subdivisions=6)
    x, y, z = mesh.vertices.T
    bumps = np.sin(9 * x) * np.sin(7 * y) * np.sin(8 * z) + 0.3 * np.sin(31 * x + 23 * z)
    return mesh.vertices * (1 + 0.15 * bumps)[:, None], mesh.faces


def load(path):
    """Vertices and faces of a file, or of the mesh made here, with a ground below."""
    if path is None:
        name, (vertices, faces) = "bumpy sphere", bumpy_sphere()
    else:
        mesh = trimesh.load(path, force="mesh", process=False)
        name, vertices, faces = os.path.basename(path), mesh.vertices, mesh.faces
    if len(faces) == 0:
        sys.exit(f"{path} has no triangles")
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    center, diagonal = (low + high) / 2, np.linalg.norm(high - low)
    x, z = center[0] + 2 * diagonal * np.array([-1, 1]), center[2] + 2 * diagonal * np.array([-1, 1])
    ground = [[x[0], low[1], z[0]], [x[0], low[1], z[1]], [x[1], low[1], z[1]], [x[1], low[1], z[0]]]
    first = len(vertices)
    vertices = np.concatenate([vertices, ground]).astype(np.float32)
    faces = np.concatenate([faces, [[first, first + 1, first + 2], [first, first + 2, first + 3]]])
    return name, vertices, faces.astype(np.int32), center, diagonal


def primary(size, center, diagonal):
    """Camera rays in tiles of 16 x 16 pixels, each in blocks of 4 x 4."""
    towards = np.array([0.35, 0.35, 1.0])
    eye = center + towards / np.linalg.norm(towards) * 1.1 * diagonal
    forward = (center - eye) / np.linalg.norm(center - eye)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    pixel = np.arange(size * size).reshape(size // 16, 4, 4, size // 16, 4, 4)
    pixel = pixel.transpose(0, 3, 1, 4, 2, 5).ravel()
    half = np.tan(np.radians(20.0))
    across = ((pixel % size + 0.5) / size * 2 - 1) * half
    down = (1 - (pixel // size + 0.5) / size * 2) * half
    directions = forward + across[:, None] * right + down[:, None] * up
    return rays(np.broadcast_to(eye, directions.shape), directions)


def diffuse(scene, origins, directions, diagonal, rng):
    """One bounce from each point that the rays see, cosine-distributed around the normal."""
    hits = scene.intersect(origins, directions)
    at = hits.hit
    origins, directions, normal = origins[at], directions[at], hits.normal[at]
    points = origins + hits.t[at, None] * directions
    normal *= -np.sign(np.einsum("ij,ij->i", normal, directions))[:, None]
    ball = rng.normal(size=points.shape)
    bounce = normal + ball / np.linalg.norm(ball, axis=1, keepdims=True)
    return rays(points + 1e-4 * diagonal * normal, bounce)


def rays(origins, directions):
    """Both as contiguous float32, which neither library has to convert."""
    return tuple(np.ascontiguousarray(array, dtype=np.float32) for array in (origins, directions))


# The calls of each query: embreex, octray on so many threads.
QUERIES = {
    "closest hit": (
        lambda embree, o, d: embree.run(o, d),
        lambda scene, o, d, threads: scene.intersect(o, d, threads=threads).prim_id,
    ),
    "distance": (
        lambda embree, o, d: embree.run(o, d, query="DISTANCE"),
        lambda scene, o, d, threads: scene.intersect(o, d, threads=threads).t,
    ),
    "any hit": (
        lambda embree, o, d: embree.run(o, d, query="OCCLUDED"),
        lambda scene, o, d, threads: scene.occluded(o, d, threads=threads),
    ),
    "all values": (
        lambda embree, o, d: embree.run(o, d, output=1),
        lambda scene, o, d, threads: scene.intersect(o, d, threads=threads).normal,
    ),
}


def compare(embree, scene, origins, directions, threads, diagonal):
    """What differs between the hits of both, over all queries; ends the script if it is much."""
    full = embree.run(origins, directions, output=1)
    hit = full["primID"] >= 0
    hits = scene.intersect(origins, directions, threads=1)
    both = hit & hits.hit
    apart = np.zeros(len(hit))
    length = np.linalg.norm(directions, axis=1)
    apart[both] = np.abs(full["tfar"][both] - hits.t[both]) * length[both] / diagonal
    other = both & (full["primID"] != hits.prim_id)
    report = {
        "rays": len(hit),
        "hits": int(hits.hit.sum()),
        "hit_by_one_only": int((hit != hits.hit).sum()),
        "other_primitive": int(other.sum()),
        "other_t": int((apart > T_TOLERANCE).sum()),
        "largest_difference_of_t": float(apart[both & ~other].max(initial=0.0)),
    }
    distance = embree.run(origins, directions, query="DISTANCE")
    agreed = {
        "embreex, closest hit": np.array_equal(embree.run(origins, directions), full["primID"]),
        "embreex, distance": np.array_equal(distance[hit], full["tfar"][hit]),
        "octray, any hit": np.array_equal(scene.occluded(origins, directions, threads=1), hits.hit),
    }
    occluded = embree.run(origins, directions, query="OCCLUDED") == 0
    report["occluded_for_one_only"] = int((occluded != hits.hit).sum())
    again = scene.intersect(origins, directions, threads=threads)
    for name in hits.keys():
        agreed[f"octray, {name} on all threads"] = np.array_equal(again[name], hits[name])
    many = scene.occluded(origins, directions, threads=threads)
    agreed["octray, any hit on all threads"] = np.array_equal(many, hits.hit)
    for what, agrees in agreed.items():
        if not agrees:
            sys.exit(f"{what}: differs from its own closest hits")
    for what in ["hit_by_one_only", "other_t", "occluded_for_one_only"]:
        if report[what] > MAX_DIFFERING * len(hit):
            sys.exit(f"{what}: {report[what]} of {len(hit)} rays, so nothing is timed: {report}")
    return report


def timed(call):
    """Seconds that a call takes: by the wall, and of this thread's CPU."""
    wall, cpu = time.perf_counter(), time.thread_time()
    call()
    return {"wall": time.perf_counter() - wall, "cpu": time.thread_time() - cpu}


def measure(embree, scene, origins, directions, query, threads, turns, clock):
    """Million rays a second of embreex and of octray on one thread and all, in turns."""
    theirs, ours = QUERIES[query]
    calls = {
        "embreex": lambda: theirs(embree, origins, directions),
        "octray, 1 thread": lambda: ours(scene, origins, directions, 1),
        "octray, all threads": lambda: ours(scene, origins, directions, threads),
    }
    for call in calls.values():
        call()
    seconds = {name: [] for name in calls}
    for _ in range(turns):
        for name, call in calls.items():
            seconds[name].append(timed(call))
    # Many threads only have the wall's time, and are compared with embreex by that.
    clocks = {"embreex": clock, "octray, 1 thread": clock, "octray, all threads": "wall"}
    rates, ratios = {}, {}
    for name, clock in clocks.items():
        times = [turn[clock] for turn in seconds[name]]
        rates[name] = len(origins) / 1e6 / statistics.median(times)
        each = sorted(a[clock] / b for a, b in zip(seconds["embreex"], times))
        ratios[name] = {"median": statistics.median(each), "least": each[0], "most": each[-1]}
    del ratios["embreex"]
    return {"million_rays_a_second": rates, "ratio_to_embreex": ratios}


def machine():
    """What the figures hold for."""
    cpu = platform.processor()
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
        cpu = names[0] if names else cpu
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "date": datetime.date.today().isoformat(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "octray": octray.__version__,
        "instruction_sets": octray.instruction_sets(),
        "embree": str(rtcore.EmbreeDevice()).strip(),
    }


def print_table(report):
    """The report for people."""
    about, mesh = report["machine"], report["mesh"]
    sets = ", ".join(about["instruction_sets"]["build"])
    print(f"{about['cpu']}, {about['cores']} cores, {about['date']}")
    print(f"octray {about['octray']} ({sets}), {about['embree']}, Python {about['python']}")
    print(f"{mesh['name']}: {mesh['triangles']} triangles with the ground\n")
    for name, found in report["agreement"].items():
        print(
            f"{name}: {found['rays']} rays, {found['hits']} hits; by one of both only "
            f"{found['hit_by_one_only']}, another primitive {found['other_primitive']}, another t "
            f"{found['other_t']}, t within {found['largest_difference_of_t']:.1e} diagonals"
        )
    print("\nmillion rays a second (median), and octray's as a multiple of embreex's")
    if report["clock_of_one_thread"] == "cpu":
        print("one thread by its CPU's time; all threads, and their multiple, by the wall's")
    head = ["workload", "query", "embreex", "1 thread", "", "all threads", ""]
    print("{:<18} {:<12} {:>8} {:>9} {:>7} {:>12} {:>7}".format(*head))
    for row in report["rows"]:
        rates, ratios = row["million_rays_a_second"], row["ratio_to_embreex"]
        one, many = "octray, 1 thread", "octray, all threads"
        print(
            f"{row['workload']:<18} {row['query']:<12} {rates['embreex']:>8.2f} {rates[one]:>9.2f}"
            f" {ratios[one]['median']:>6.2f}x {rates[many]:>12.2f} {ratios[many]['median']:>6.2f}x"
        )


def plot(report, path):
    """A chart of the ratios, with a line where both are as fast."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = report["rows"]
    workloads = list(dict.fromkeys(row["workload"] for row in rows))
    figure, charts = pyplot.subplots(1, 2, figsize=(12, 4.5), layout="constrained")
    for chart, name in zip(charts, ["octray, 1 thread", "octray, all threads"]):
        width = 0.8 / len(QUERIES)
        for place, query in enumerate(QUERIES):
            found = [row["ratio_to_embreex"][name] for row in rows if row["query"] == query]
            middle = np.array([ratio["median"] for ratio in found])
            spread = [middle - [ratio["least"] for ratio in found]]
            spread.append([ratio["most"] for ratio in found] - middle)
            left = np.arange(len(workloads)) + (place - (len(QUERIES) - 1) / 2) * width
            bars = chart.bar(left, middle, width, yerr=spread, capsize=2, label=query)
            chart.bar_label(bars, fmt="%.1f", fontsize=8)
        chart.axhline(1.0, color="black", linewidth=1, linestyle="--")
        chart.set_xticks(np.arange(len(workloads)), workloads)
        chart.set_ylabel("rays a second, embreex = 1")
        chart.set_title(f"{name} (embreex has one)")
    charts[0].legend()
    about, mesh = report["machine"], report["mesh"]
    figure.suptitle(
        f"octray {about['octray']} and embreex on {mesh['name']}, {mesh['triangles']} triangles"
        f"\n{about['cpu']}, {about['date']}"
    )
    figure.savefig(path)


def arguments():
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("mesh", nargs="?", help="any file that trimesh loads")
    parser.add_argument("--size", type=int, default=1024, help="camera rays on a side (1024)")
    parser.add_argument("--turns", type=int, default=7, help="how often each call is timed (7)")
    parser.add_argument("--threads", type=int, default=0, help="for `all threads`: 0 is every core")
    parser.add_argument("--seed", type=int, default=1, help="of bounces and orders (1)")
    parser.add_argument(
        "--clock",
        choices=["wall", "cpu"],
        default="wall",
        help="what one thread is timed by: its CPU's time is fairer where others use the machine",
    )
    parser.add_argument("--json", metavar="FILE", help="write the report; - for the standard output")
    parser.add_argument("--plot", metavar="FILE", help="draw the ratios: .svg, .png, .pdf")
    chosen = parser.parse_args()
    if chosen.size < 16 or chosen.size % 16 != 0:
        parser.error("--size must be a multiple of 16")
    if chosen.turns < 1:
        parser.error("--turns must be at least 1")
    return chosen


def main():
    """Runs the comparison."""
    chosen = arguments()
    name, vertices, faces, center, diagonal = load(chosen.mesh)
    rng = np.random.default_rng(chosen.seed)
    scene = octray.Scene.from_mesh(vertices, faces)
    embree = rtcore_scene.EmbreeScene()
    # Bound to a name, so that it lives as long as the scene.
    embree_mesh = TriangleMesh(embree, vertices, faces)

    camera = primary(chosen.size, center, diagonal)
    bounces = diffuse(scene, *camera, diagonal, rng)
    workloads = {"primary": camera, "diffuse": bounces}
    for kind in list(workloads):
        order = rng.permutation(len(workloads[kind][0]))
        workloads[f"{kind}, shuffled"] = tuple(array[order] for array in workloads[kind])

    report = {
        "machine": machine(),
        "mesh": {"name": name, "triangles": len(faces)},
        "clock_of_one_thread": chosen.clock,
        "turns": chosen.turns,
        "agreement": {},
        "rows": [],
    }
    for workload, batch in workloads.items():
        found = compare(embree, scene, *batch, chosen.threads, diagonal)
        report["agreement"][workload] = found
        for query in QUERIES:
            how = chosen.threads, chosen.turns, chosen.clock
            row = measure(embree, scene, *batch, query, *how)
            report["rows"].append({"workload": workload, "query": query, **row})
    del embree_mesh

    if chosen.json == "-":
        json.dump(report, sys.stdout, indent=2)
        print()
    else:
        print_table(report)
    if chosen.json not in (None, "-"):
        with open(chosen.json, "w", encoding="utf-8") as file:
            json.dump(report, file, indent=2)
            file.write("\n")
    if chosen.plot:
        plot(report, chosen.plot)


if __name__ == "__main__":
    main()
