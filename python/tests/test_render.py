"""Pictures of scene files."""

import os
import pathlib
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import octray

CORNELL = pathlib.Path(__file__).parents[2] / "scenes" / "cornell-soft-shadows.toml"


def test_a_picture_is_an_array_and_the_same_on_any_threads():
    options = {"width": 80, "height": 60, "spp": 1, "shadow_samples": 4, "seed": 3}
    picture = octray.render(CORNELL, **options)
    assert picture.shape == (60, 80, 3) and picture.dtype == np.float32
    assert np.isfinite(picture).all() and picture.min() >= 0 and 0.05 < picture.mean() < 5
    np.testing.assert_array_equal(octray.render(str(CORNELL), threads=1, **options), picture)
    other = octray.render(CORNELL, **(options | {"seed": 4}))
    assert (other != picture).any()


def test_progress_is_told_and_may_end_the_rendering():
    told = []
    options = {"width": 640, "height": 480, "spp": 2, "shadow_samples": 4}
    octray.render(CORNELL, progress=lambda *counts: told.append(counts), **options)
    done, total = told[-1]
    # Tiles of 64 x 64, or of 32 x 32 where these would be too few for the threads.
    assert told == sorted(told) and done == total and total in (10 * 8, 20 * 15)

    class Enough(Exception):
        pass

    def stop(done, total):
        raise Enough

    with pytest.raises(Enough):
        octray.render(CORNELL, progress=stop, **options)


def test_a_missing_file_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere.toml"):
        octray.render(tmp_path / "nowhere.toml")


def test_a_wrong_file_or_setting_is_a_value_error(tmp_path):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("[camera]\neye = 'here'\n")
    with pytest.raises(ValueError, match=r"wrong\.toml:2"):
        octray.render(wrong)
    for setting in ["width", "height", "spp", "shadow_samples"]:
        for value in [0, -1, 2**40]:
            with pytest.raises(ValueError):
                octray.render(CORNELL, **{setting: value})
    with pytest.raises(ValueError, match="threads is -7"):
        octray.render(CORNELL, threads=-7)


@pytest.mark.skipif(os.name != "posix", reason="sends a signal")
def test_ctrl_c_stops_a_long_picture():
    code = (
        "import octray, sys\n"
        "print('ready', flush=True)\n"
        "try:\n"
        "    octray.render(sys.argv[1], width=4000, height=3000, spp=256, shadow_samples=64)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted')\n"
    )
    command = [sys.executable, "-c", code, str(CORNELL)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        start = time.monotonic()
        out, _ = process.communicate(timeout=120)
        assert time.monotonic() - start < 30
    assert out == "interrupted\n"


def test_instruction_sets_are_told():
    sets = octray.instruction_sets()
    assert set(sets["build"]) <= set(sets["cpu"])
    assert sets["cpu"]
