"""Threads: their number, the interpreter's lock, Ctrl-C and processes."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import random_rays

import octray


@pytest.mark.parametrize("threads", [-1, 1, 2, 3, 10**9])
def test_the_number_of_threads_changes_nothing(scene, threads):
    origins, directions = random_rays(60_000)
    expected = scene.intersect(origins, directions, threads=0)
    hits = scene.intersect(origins, directions, threads=threads)
    for name in hits.keys():
        np.testing.assert_array_equal(hits[name], expected[name])
    occluded = scene.occluded(origins, directions, threads=threads)
    np.testing.assert_array_equal(occluded, expected.hit)


@pytest.mark.parametrize("threads", [-2, -100])
def test_other_negative_numbers_are_refused(scene, threads):
    for query in [scene.intersect, scene.occluded]:
        with pytest.raises(ValueError, match=f"threads is {threads}"):
            query(*random_rays(10), threads=threads)


def test_python_runs_while_rays_are_traced(scene):
    rays = random_rays(1_000_000)
    done = threading.Event()
    worker = threading.Thread(target=lambda: (scene.intersect(*rays, threads=1), done.set()))
    interval = sys.getswitchinterval()
    # A trace that held the lock would be waited for only once.
    sys.setswitchinterval(10.0)
    try:
        worker.start()
        turns = 0
        while not done.is_set():
            time.sleep(0.001)
            turns += 1
    finally:
        sys.setswitchinterval(interval)
        worker.join()
    assert turns > 10


def test_python_threads_share_a_scene(scene):
    rays = random_rays(20_000)
    expected = scene.intersect(*rays).t
    results = []
    trace = lambda: results.append(scene.intersect(*rays).t)  # noqa: E731
    workers = [threading.Thread(target=trace) for _ in range(8)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert len(results) == 8
    for result in results:
        np.testing.assert_array_equal(result, expected)


LONG_TRACE = """
import sys
import numpy as np, octray
# Spheres within spheres: a ray meets the boxes of all, so that it takes long.
scene = octray.Scene.from_spheres(np.zeros((2_000, 3)), np.linspace(1, 2, 2_000))
directions = np.random.default_rng(0).normal(size=(4_000_000, 3)).astype(np.float32)
print("ready", flush=True)
try:
    scene.intersect([0, 0, 0], directions, threads=int(sys.argv[1]))
    print("finished")
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(os.name != "posix", reason="sends a signal")
@pytest.mark.parametrize("threads", ["1", "0"])
def test_ctrl_c_stops_a_long_trace(threads):
    command = [sys.executable, "-c", LONG_TRACE, threads]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        start = time.monotonic()
        out, _ = process.communicate(timeout=60)
        assert time.monotonic() - start < 30
    assert out == "interrupted\n"


def trace_in_child(scene, rays, queue):
    """Traces in another process."""
    queue.put(scene.intersect(*rays).t)


@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_child_processes_trace_too(scene, method):
    rays = random_rays(20_000)
    expected = scene.intersect(*rays).t
    context = multiprocessing.get_context(method)
    queue = context.Queue()
    child = context.Process(target=trace_in_child, args=(scene, rays, queue))
    child.start()
    np.testing.assert_array_equal(queue.get(timeout=60), expected)
    child.join(timeout=60)
    assert child.exitcode == 0
