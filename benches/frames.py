#!/usr/bin/env python3
# /// script
# requires-python = ">=3.11"
# dependencies = [
#     "mitsuba==3.9.1",
#     "numpy==2.4.6",
# ]
# ///
"""The same pictures by octray, Mitsuba 3 and POV-Ray, side by side; set-up and tracing apart.

    cargo build --release
    python benches/frames.py [--mesh BUNNY.obj] [--json OUT.json] [--pictures FOLDER] [--cpu-time]

Four pictures of 1024 x 1024 with one ray a pixel: the Cornell box with 16 and 64 shadow rays a
point, a mesh on a plane and a scan of a million triangles with 16. Without --mesh a bumpy sphere
stands on the plane. A renderer that is missing is left out, with what would bring it. Needs numpy.

All get the same camera, surfaces, mirrors, area light and number of shadow rays, taken from
octray's own scene file:

- Mitsuba: llvm_ad_rgb, the integrator `direct` with emitter samples alone. It follows no mirrors,
  so its time is held against octray without mirrors; and it shades physically, so light falls off.
- POV-Ray: `area_light` with jitter and without `adaptive`; mirrors as in octray.

Set-up is reading the scene and building the tree; for Mitsuba also compiling its kernels, once a
scene; for octray reading is from text, for Mitsuba from arrays. Tracing is the picture alone. The
renderers take turns, and a ratio is the median over the turns of their seconds by octray's.
"""

import argparse
import json
import math
import os
import pathlib
import platform
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib

try:
    import numpy as np
except ImportError as error:
    sys.exit(f"{error}: pip install numpy")

ROOT = pathlib.Path(__file__).resolve().parent.parent

ON_A_PLANE = """
[camera]
eye = {eye}
target = {center}
vertical_fov = 32
[render]
background = [0.5, 0.6, 0.7]
[[lights]]
type = "area"
corner = {light}
edge_u = [{side}, 0, 0]
edge_v = [0, 0, {side}]
ambient = 0.15
diffuse = 0.85
[materials.clay]
color = [0.75, 0.6, 0.5]
[materials.floor]
color = [0.6, 0.6, 0.6]
[[quads]]
corner = {floor}
edge_u = [{wide}, 0, 0]
edge_v = [0, 0, {back}]
material = "floor"
[[meshes]]
path = {path}
material = "clay"
"""


class Missing(Exception):
    """A renderer that is not there, and how to get it."""


def read_obj(path):
    """Positions and triangles of an OBJ file."""
    positions, faces = [], []
    with open(path, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            words = line.split()
            if words[:1] == ["v"]:
                positions.append(words[1:4])
            elif words[:1] == ["f"]:
                corners = [int(word.split("/")[0]) for word in words[1:]]
                corners = [c - 1 if c > 0 else len(positions) + c for c in corners]
                faces += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]
    return np.array(positions, np.float32), np.array(faces, np.uint32), None


def knot(keys):
    """The generated tube of a scene file: positions, triangles, normals."""
    value = {"p": 2, "q": 3, "radius": 1, "spread": 0.4, "tube": 0.25, "segments": 256, "sides": 32}
    value |= {key: keys[key] for key in value if key in keys}
    p, q, radius, spread = (value[key] for key in ("p", "q", "radius", "spread"))
    rings, sides = value["segments"], value["sides"]
    turn = np.arange(rings)[:, None] * (2 * math.pi / rings)
    zero = np.zeros_like(turn)
    sin_p, cos_p, sin_q, cos_q = np.sin(p * turn), np.cos(p * turn), np.sin(q * turn), np.cos(q * turn)
    outwards = np.hstack([cos_q * cos_p, sin_q, cos_q * sin_p])
    around = np.hstack([-sin_p, zero, cos_p])
    across = np.hstack([-sin_q * cos_p, cos_q, -sin_q * sin_p])
    middle = np.hstack([cos_p, zero, sin_p]) * radius + outwards * spread
    tangent = around * (p * (radius + spread * cos_q)) + across * (q * spread)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side_axis = np.cross(tangent, outwards)
    angle = np.arange(sides)[None, :, None] * (2 * math.pi / sides)
    normals = outwards[:, None] * np.cos(angle) + side_axis[:, None] * np.sin(angle)
    positions = middle[:, None] + normals * value["tube"]
    ring, side = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    ahead, beside = (ring + 1) % rings, (side + 1) % sides
    a, b = ring * sides + side, ring * sides + beside
    c, d = ahead * sides + beside, ahead * sides + side
    faces = np.stack([np.stack([a, b, d], -1), np.stack([b, c, d], -1)], 2).reshape(-1, 3)
    return positions.reshape(-1, 3), faces.astype(np.uint32), normals.reshape(-1, 3)


def bumpy_sphere(triangles):
    """A closed body of about so many triangles, dense as a scan: a cube's faces blown up."""
    side = max(2, round(math.sqrt(triangles / 12)))
    along = np.tan(np.linspace(-math.pi / 4, math.pi / 4, side + 1))
    u, v = np.meshgrid(along, along, indexing="ij")
    row, column = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    a = row * (side + 1) + column
    b, c, d = a + side + 1, a + side + 2, a + 1
    cells = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    positions, faces = [], []
    for axis in range(3):
        for sign in (1.0, -1.0):
            cube = np.empty((side + 1, side + 1, 3))
            cube[..., axis], cube[..., (axis + 1) % 3], cube[..., (axis + 2) % 3] = sign, u, v
            faces.append((cells if sign > 0 else cells[:, ::-1]) + len(positions) * u.size)
            positions.append(cube.reshape(-1, 3))
    p = np.concatenate(positions)
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    x, y, z = p.T
    bumps = np.sin(7 * x) * np.sin(6 * y) * np.sin(8 * z) + 0.2 * np.sin(31 * x + 23 * z)
    grain = np.sin(211 * x + 3 * z) * np.sin(190 * y) * np.sin(223 * z)
    return p * (1 + 0.12 * bumps + 0.002 * grain)[:, None], np.concatenate(faces).astype(np.uint32)


def write_obj(path, positions, faces):
    with open(path, "w", encoding="ascii") as out:
        np.savetxt(out, positions, "v %.7g %.7g %.7g")
        np.savetxt(out, faces.astype(np.int64) + 1, "f %d %d %d")


def on_a_plane(folder, name, mesh_file):
    """Writes the scene file of a mesh on a plane, seen from in front, lit from above."""
    positions, _, _ = read_obj(mesh_file)
    low, high = positions.min(axis=0), positions.max(axis=0)
    center, size = (low + high) / 2, float(np.linalg.norm(high - low))
    number = lambda point: str([round(float(x), 6) for x in point])
    side = 0.3 * size
    floor_y = float(low[1])
    text = ON_A_PLANE.format(
        eye=number(center + np.array([0.5, 0.5, 1.6]) * size),
        center=number(center),
        light=number(center + np.array([-0.7, 1.6, 0.4]) * size),
        side=side,
        floor=number([center[0] - 5 * size, floor_y, center[2] + 5 * size]),
        wide=10 * size,
        back=-10 * size,
        path=json.dumps(str(pathlib.Path(mesh_file).resolve())),
    )
    file = folder / f"{name}.toml"
    file.write_text(text)
    return file


class Scene:
    """A scene file as plain numbers."""

    def __init__(self, file):
        keys = tomllib.loads(file.read_text())
        self.file = file
        camera = keys["camera"]
        self.eye, self.target = camera["eye"], camera["target"]
        self.up, self.fov = camera.get("up", [0, 1, 0]), camera.get("vertical_fov", 40)
        self.background = three(keys.get("render", {}).get("background", 0))
        if [light["type"] for light in keys["lights"]] != ["area"]:
            sys.exit(f"{file}: exactly one area light is exported")
        light = keys["lights"][0]
        self.corner, self.edge_u, self.edge_v = (
            np.array(light[key], float) for key in ("corner", "edge_u", "edge_v")
        )
        self.light = three(light.get("diffuse", light.get("intensity", 1)))
        self.ambient = three(light.get("ambient", 0))
        self.materials = keys.get("materials", {})
        self.spheres, self.quads = keys.get("spheres", []), keys.get("quads", [])
        self.meshes = [(self.mesh(one), one.get("material")) for one in keys.get("meshes", [])]

    def mesh(self, keys):
        if "rotate" in keys or "matrix" in keys or keys.get("generate", "knot") != "knot":
            sys.exit(f"{self.file}: only files and knots, scaled and moved, are exported")
        if "path" in keys:
            positions, faces, normals = read_obj(self.file.parent / keys["path"])
        else:
            positions, faces, normals = knot(keys)
        scale = keys.get("scale", 1)
        return positions * scale + np.array(keys.get("translate", [0, 0, 0])), faces, normals

    def material(self, name):
        """Ambient, diffuse, specular colour, shininess, mirror."""
        keys = self.materials.get(name, {})
        color = keys.get("color", 0.8)
        parts = (keys.get("ambient", color), keys.get("diffuse", color), keys.get("specular", 0))
        return (*map(three, parts), keys.get("shininess", 32), keys.get("mirror", 0))

    def has_mirrors(self):
        return any(keys.get("mirror", 0) > 0 for keys in self.materials.values())

    def light_center(self):
        return self.corner + (self.edge_u + self.edge_v) / 2


def three(color):
    return np.array([color] * 3 if isinstance(color, (int, float)) else color, float)


def child_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Octray:
    name = "octray"

    def __init__(self, args, bounces=None):
        self.args, self.bounces = args, bounces
        self.program = os.environ.get("OCTRAY") or ROOT / "target/release/octray"
        if not pathlib.Path(self.program).exists():
            raise Missing("cargo build --release")
        version = subprocess.run([self.program, "--version"], capture_output=True, text=True)
        self.version = version.stdout.strip().removeprefix("octray ")

    def run(self, more):
        arguments = [self.program, "render", self.file, "-q", "--json", "-o", self.output]
        arguments += ["--size", f"{self.args.side}x{self.args.side}", "--spp", "1"]
        arguments += ["--shadow-samples", str(self.samples), "--threads", str(self.threads)]
        if self.bounces is not None:
            arguments += ["--max-bounces", str(self.bounces)]
        before = child_seconds()
        done = subprocess.run([*arguments, *more], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"octray: {done.stderr}")
        return json.loads(done.stdout)["seconds"], child_seconds() - before

    def set_up(self, scene, samples, threads, output):
        self.file, self.samples, self.threads = scene.file, samples, threads
        self.output = output.with_suffix(".bmp")
        seconds, self.cpu_without = self.run(["--crop", "0,0,1,1"])
        return seconds["load"]

    def trace(self):
        seconds, cpu = self.run([])
        return cpu - self.cpu_without if self.args.cpu_time else seconds["render"]


class Mitsuba:
    name = "Mitsuba"

    def __init__(self, args):
        self.args = args
        try:
            import mitsuba
        except ImportError:
            raise Missing("pip install mitsuba==3.9.1") from None
        self.mi, self.version = mitsuba, mitsuba.__version__
        mitsuba.set_variant("llvm_ad_rgb")
        import drjit

        self.dr = drjit
        try:
            drjit.eval(mitsuba.Float(1) + drjit.arange(mitsuba.Float, 2))
        except Exception:
            raise Missing("install LLVM's shared library, such as `apt install libllvm19`, or name "
                          "it in DRJIT_LIBLLVM_PATH") from None

    def bsdf(self, scene, name):
        _, diffuse, _, _, mirror = scene.material(name)
        if mirror > 0:
            return {"type": "twosided", "bsdf": {"type": "conductor"}}
        color = {"type": "rgb", "value": diffuse.tolist()}
        return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": color}}

    def rectangle(self, corner, u, v):
        corner, u, v = (np.array(part, float) for part in (corner, u, v))
        normal = np.cross(u, v)
        columns = [u / 2, v / 2, normal / np.linalg.norm(normal), corner + (u + v) / 2]
        matrix = np.vstack([np.column_stack(columns), [0, 0, 0, 1]])
        return {"type": "rectangle", "to_world": self.mi.ScalarTransform4f(matrix)}

    def mesh(self, scene, positions, faces, normals, material):
        props = self.mi.Properties()
        props["bsdf"] = self.mi.load_dict(self.bsdf(scene, material))
        smooth = normals is not None
        mesh = self.mi.Mesh("mesh", len(positions), len(faces), props, smooth)
        params = self.mi.traverse(mesh)
        params["vertex_positions"] = np.ravel(positions).astype(np.float32)
        params["faces"] = np.ravel(faces)
        if smooth:
            params["vertex_normals"] = np.ravel(normals).astype(np.float32)
        params.update()
        return mesh

    def set_up(self, scene, samples, threads, output):
        start = self.now()
        self.output, self.seed = output.with_suffix(".png"), 0
        self.dr.set_thread_count(threads or os.cpu_count())
        integrator = {"type": "direct", "emitter_samples": samples, "bsdf_samples": 0,
                      "hide_emitters": True}
        film = {"type": "hdrfilm", "width": self.args.side, "height": self.args.side,
                "rfilter": {"type": "box"}}
        look = self.mi.ScalarTransform4f().look_at(scene.eye, scene.target, scene.up)
        sensor = {"type": "perspective", "fov": scene.fov, "to_world": look, "film": film,
                  "sampler": {"type": "independent", "sample_count": 1}}
        u, v = scene.edge_u, scene.edge_v
        toward = np.array(scene.target) - scene.light_center()
        if np.dot(np.cross(u, v), toward) < 0:
            u, v = v, u
        area = np.linalg.norm(np.cross(u, v))
        # As bright at the target as octray's light, which does not fall off.
        cosine = np.dot(np.cross(u, v), toward) / area / np.linalg.norm(toward)
        radiance = scene.light * math.pi * np.dot(toward, toward) / (area * cosine)
        lamp = self.rectangle(scene.corner, u, v)
        lamp["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": radiance.tolist()}}
        parts = {"type": "scene", "integrator": integrator, "sensor": sensor, "lamp": lamp}
        for index, quad in enumerate(scene.quads):
            one = self.rectangle(quad["corner"], quad["edge_u"], quad["edge_v"])
            parts[f"quad{index}"] = one | {"bsdf": self.bsdf(scene, quad.get("material"))}
        for index, sphere in enumerate(scene.spheres):
            parts[f"sphere{index}"] = {
                "type": "sphere", "center": sphere["center"], "radius": sphere["radius"],
                "bsdf": self.bsdf(scene, sphere.get("material")),
            }
        for index, ((positions, faces, normals), material) in enumerate(scene.meshes):
            parts[f"mesh{index}"] = self.mesh(scene, positions, faces, normals, material)
        self.scene = self.mi.load_dict(parts)
        self.render()
        return self.now() - start

    def now(self):
        return time.process_time() if self.args.cpu_time else time.perf_counter()

    def render(self):
        self.seed += 1
        image = self.mi.render(self.scene, spp=1, seed=self.seed)
        self.dr.eval(image)
        self.dr.sync_thread()
        return image

    def trace(self):
        start = self.now()
        image = self.render()
        seconds = self.now() - start
        if self.seed == 2:
            self.mi.util.write_bitmap(str(self.output), image, write_async=False)
        return seconds


class PovRay:
    name = "POV-Ray"

    def __init__(self, args):
        self.args = args
        if not shutil.which("povray"):
            raise Missing("install POV-Ray 3.7 or newer, such as `apt install povray`")
        told = subprocess.run(["povray", "--version"], capture_output=True, text=True)
        self.version = re.search(r"POV-Ray (\S+)", told.stderr + told.stdout)[1]

    def texture(self, scene, name):
        ambient, diffuse, specular, shininess, mirror = scene.material(name)
        # A finish scales the pigment; a surface that only glows has its ambient colour as one.
        glows = not diffuse.any()
        pigment = ambient * scene.ambient if glows else diffuse
        finish = "ambient 1 diffuse 0" if glows else (
            f"ambient rgb {vector(scene.ambient * ambient / np.maximum(diffuse, 1e-6) * (1 - mirror))} "
            f"diffuse {1 - mirror} phong {specular.mean()} phong_size {shininess} "
            f"reflection {mirror}"
        )
        return f"texture {{ pigment {{ rgb {vector(pigment)} }} finish {{ {finish} }} }}"

    def text(self, scene, samples):
        side = math.isqrt(samples)
        if side * side != samples:
            sys.exit("POV-Ray's area lights have a square of samples: give such a number")
        yield "#version 3.7;\nglobal_settings { assumed_gamma 1 max_trace_level 6 }\n"
        yield f"background {{ rgb {vector(scene.background)} }}\n"
        yield (f"camera {{ perspective location {vector(scene.eye)} sky {vector(scene.up)} "
               f"right -x up y angle {scene.fov} look_at {vector(scene.target)} }}\n")
        yield (f"light_source {{ {vector(scene.light_center())} rgb {vector(scene.light)} "
               f"area_light {vector(scene.edge_u)}, {vector(scene.edge_v)}, {side}, {side} "
               "jitter }\n")
        for quad in scene.quads:
            a, u, v = (np.array(quad[key], float) for key in ("corner", "edge_u", "edge_v"))
            corners = ", ".join(map(vector, (a, a + u, a + u + v, a + v, a)))
            yield f"polygon {{ 5, {corners} {self.texture(scene, quad.get('material'))} }}\n"
        for sphere in scene.spheres:
            yield (f"sphere {{ {vector(sphere['center'])}, {sphere['radius']} "
                   f"{self.texture(scene, sphere.get('material'))} }}\n")
        for (positions, faces, normals), material in scene.meshes:
            yield f"mesh2 {{ vertex_vectors {{ {len(positions)}{rows(positions)} }}\n"
            if normals is not None:
                yield f"normal_vectors {{ {len(normals)}{rows(normals)} }}\n"
            yield f"face_indices {{ {len(faces)}{rows(faces)} }}\n"
            yield f"{self.texture(scene, material)} }}\n"

    def set_up(self, scene, samples, threads, output):
        self.output, self.threads = output.with_suffix(".png"), threads or os.cpu_count()
        self.input = output.with_suffix(".pov")
        with open(self.input, "w", encoding="ascii") as out:
            out.writelines(self.text(scene, samples))
        told = self.run(1)
        return self.seconds(told, "Parse") + self.seconds(told, "Bounding")

    def run(self, side):
        arguments = ["povray", f"+I{self.input}", f"+O{self.output}", f"+W{side}", f"+H{side}",
                     "-A", "-D", f"+WT{self.threads}"]
        done = subprocess.run(arguments, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"POV-Ray: {done.stderr[-2000:]}")
        return done.stderr

    def seconds(self, told, phase):
        clocks = re.search(rf"{phase} Time:[^(]*\(([\d.]+) seconds\)"
                           r"(?:\s+using \d+ thread\(s\) with ([\d.]+) CPU-seconds)?", told)
        if not clocks:
            return 0.0
        return float(clocks[2] if self.args.cpu_time and clocks[2] else clocks[1])

    def trace(self):
        return self.seconds(self.run(self.args.side), "Trace")


def vector(numbers):
    return "<" + ", ".join(f"{number:.7g}" for number in numbers) + ">"


def rows(numbers):
    """Rows of three numbers as POV-Ray reads them."""
    form = "%d" if numbers.dtype.kind in "ui" else "%.7g"
    line = f",<{form},{form},{form}>"
    return "".join(line % tuple(row) for row in numbers.tolist())


def race(args, scene, name, samples, threads, folder):
    """Times all renderers on one picture, in turns."""
    out = pathlib.Path(args.pictures or folder)
    contenders = [Octray(args)]
    if scene.has_mirrors():
        flat = Octray(args, bounces=0)
        flat.name = "octray, no mirrors"
        contenders.append(flat)
    for kind in (Mitsuba, PovRay):
        try:
            contenders.append(kind(args))
        except Missing as missing:
            print(f"{kind.name} is left out: {missing}", file=sys.stderr)
    set_up, traced = {}, {one.name: [] for one in contenders}
    for one in contenders:
        tag = re.sub(r"\W+", "-", one.name.lower())
        set_up[one.name] = one.set_up(scene, samples, threads, out / f"{name}-{samples}-{tag}")
    for _ in range(args.turns):
        for one in contenders:
            traced[one.name].append(one.trace())
    lines = []
    for one in contenders:
        is_mitsuba = one.name == "Mitsuba" and scene.has_mirrors()
        ours = traced["octray, no mirrors" if is_mitsuba else "octray"]
        ratios = [theirs / mine for theirs, mine in zip(traced[one.name], ours)]
        lines.append({
            "picture": name, "shadow_samples": samples, "threads": threads or os.cpu_count(),
            "renderer": one.name, "version": one.version, "set_up_seconds": set_up[one.name],
            "trace_seconds": statistics.median(traced[one.name]),
            "ratio": statistics.median(ratios),
        })
        line = lines[-1]
        print(f"{name:<12} {samples:>4} {line['threads']:>7}  {one.name:<18} "
              f"{line['set_up_seconds']:>8.3f} {line['trace_seconds']:>8.3f} {line['ratio']:>7.2f}",
              flush=True)
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--mesh", help="an OBJ file for the mesh on a plane, such as the bunny")
    parser.add_argument("--scan-triangles", type=int, default=1_000_000)
    parser.add_argument("--side", type=int, default=1024, help="of the picture, in pixels")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--threads", help="such as `1` or `1,0`; 0 is all (default: 1,0)")
    parser.add_argument("--only", help="part of a picture's name")
    parser.add_argument("--cpu-time", action="store_true",
                        help="CPU seconds instead of wall time, one thread: for busy machines")
    parser.add_argument("--pictures", help="a folder to keep the pictures in")
    parser.add_argument("--json", help="a file for the numbers")
    args = parser.parse_args()
    threads = [int(n) for n in (args.threads or ("1" if args.cpu_time else "1,0")).split(",")]
    if args.cpu_time and threads != [1]:
        parser.error("--cpu-time counts the work of all threads: give --threads 1")
    if args.pictures:
        os.makedirs(args.pictures, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        box = ROOT / "scenes/cornell-box.toml"
        pictures = [("cornell-box", lambda: box, 16), ("cornell-box", lambda: box, 64)]

        def made(name, triangles):
            file = folder / f"{name}.obj"
            write_obj(file, *bumpy_sphere(triangles))
            return on_a_plane(folder, name, file)

        if args.mesh:
            mesh_name = pathlib.Path(args.mesh).stem
            pictures.append((mesh_name, lambda: on_a_plane(folder, mesh_name, args.mesh), 16))
        else:
            pictures.append(("bumpy", lambda: made("bumpy", 70_000), 16))
        pictures.append(("scan", lambda: made("scan", args.scan_triangles), 16))
        try:
            Octray(args)
        except Missing as missing:
            sys.exit(f"octray is missing: {missing}, or name the program in OCTRAY")
        clock = "CPU" if args.cpu_time else "wall"
        print(f"{args.side}x{args.side}, {args.turns} turns, seconds of {clock} time, "
              f"{platform.processor() or platform.machine()}, {os.cpu_count()} CPUs")
        print(f"{'picture':<12} {'rays':>4} {'threads':>7}  {'renderer':<18} {'set-up':>8} "
              f"{'tracing':>8} {'ratio':>7}")
        lines = []
        for name, file, samples in pictures:
            if not args.only or args.only in name:
                scene = Scene(file())
                for count in threads:
                    lines += race(args, scene, name, samples, count, folder)
    if args.json:
        note = {"side": args.side, "turns": args.turns, "clock": clock, "cpus": os.cpu_count(),
                "rows": lines}
        pathlib.Path(args.json).write_text(json.dumps(note, indent=2) + "\n")


if __name__ == "__main__":
    main()
