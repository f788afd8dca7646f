import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from refseq_bench.sim.rendering.drivers import vulkan_device

ROOT = Path(__file__).parents[3]
PRELUDE = """
import ctypes, os, sys, threading
from refseq_bench.sim.rendering.native_output import dropping_lines
libc = ctypes.CDLL(None)
"""


def printed(program: str, **more: object) -> str:
    code = PRELUDE + textwrap.dedent(program)
    kept = {"env": {**os.environ, "PYTHONPATH": str(ROOT)}, "check": True, "timeout": 60, "text": True}
    return subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, **{**kept, **more}).stdout


def test_only_lines_with_the_beginning_are_dropped() -> None:
    told = printed("""
        libc.puts(b"noise before")
        with dropping_lines(b"noise"):
            libc.puts(b"noise 1")
            libc.puts(b"a warning, no noise")
            with dropping_lines(b"noise"):
                libc.puts(b"noise 2")
                libc.puts(b"inner")
            libc.printf(b"half a line, ")
            libc.puts(b"and the rest")
        libc.puts(b"noise behind")
    """)
    assert told.splitlines() == [
        "noise before", "a warning, no noise", "inner", "half a line, and the rest", "noise behind",
    ]  # fmt: skip


def test_python_and_children_print_past_it() -> None:
    told = printed("""
        with dropping_lines(b"noise"):
            print("noise of Python", flush=True)
            os.system("echo noise of a child")
    """)
    assert sorted(told.splitlines()) == ["noise of Python", "noise of a child"]


def test_threads_and_forked_children_share_one_output() -> None:
    told = printed("""
        def work(name):
            for n in range(200):
                with dropping_lines(b"noise"):
                    libc.puts(b"noise")
                    if n == 100:
                        libc.puts(name)
        threads = [threading.Thread(target=work, args=(name,)) for name in (b"one", b"two", b"three")]
        [thread.start() for thread in threads], [thread.join() for thread in threads]
        libc.fflush(None)
        if not os.fork():
            work(b"child")
            libc.fflush(None)
            os._exit(0)
        os.wait()
        libc.puts(b"end")
    """)
    assert sorted(told.splitlines()) == ["child", "end", "one", "three", "two"]


def test_of_threads_that_print_at_once_no_line_is_lost_or_told_twice() -> None:
    told = printed("""
        def work():
            for n in range(2000):
                with dropping_lines(b"noise"):
                    libc.puts(b"noise" * 50)
                    if n % 100 == 1:
                        libc.puts(b"told")
        threads = [threading.Thread(target=work) for _ in range(4)]
        [thread.start() for thread in threads], [thread.join() for thread in threads]
        libc.fflush(None)
    """)
    assert told.splitlines() == ["told"] * 80


def test_a_closed_standard_output_is_no_error() -> None:
    program = PRELUDE + "\nwith dropping_lines(b'noise'):\n    libc.puts(b'noise')\n    libc.puts(b'more')\n"
    done = subprocess.run(
        ["sh", "-c", '"$0" -c "$1" >&-', sys.executable, program],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
def test_filament_says_nothing_of_frames_that_it_does_not_time() -> None:
    """Its thread that waits for frames starves on a busy machine only, so here the lines are printed as it would."""
    told = printed("""
        import mujoco
        from refseq_bench.sim.rendering.filament import FilamentRenderer

        class Loud:
            def __init__(self, context):
                self.context = context
            def __getattr__(self, name):
                return getattr(self.context, name)
            def render(self, *requests):
                libc.printf(b"FrameInfo's circular queue is full, but the oldest item hasn't been processed yet.")
                libc.printf(b" Skipping this frame, id = %d\\n", 87)
                libc.puts(b"RenderPass arena is full, using slower system heap.")
                return self.context.render(*requests)

        spec = mujoco.MjSpec.from_string('<mujoco><worldbody><camera name="c"/></worldbody></mujoco>')
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        renderer = FilamentRenderer(model)
        renderer.radiance(data, "c", 16, 12)
        renderer._context = Loud(renderer._context)
        renderer.radiance(data, "c", 16, 12)
        renderer.close()
    """)
    assert told.splitlines() == ["RenderPass arena is full, using slower system heap."]
