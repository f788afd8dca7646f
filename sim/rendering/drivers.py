"""Drivers of this machine for drawing: a Vulkan device for Filament, software or hardware GL for classic drawing."""

import contextlib
import ctypes
import importlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from types import ModuleType
from typing import IO, Any, NamedTuple

from refseq_bench.sim.errors import RendererError
from refseq_bench.sim.rendering.renderer import BY_OPENGL, RendererKind, others_than

VULKAN_PACKAGES = "libvulkan1 mesa-vulkan-drivers"
"""Debian and Ubuntu packages that bring a Vulkan device to any machine."""
GL_PACKAGES = "libegl1 libgl1-mesa-dri"
"""Debian and Ubuntu packages for EGL; with ``MUJOCO_GL=osmesa``, ``libosmesa6`` does instead."""
GL_BACKENDS = ("egl", "osmesa")
"""Ways to a GL context without a screen; the first one unless ``MUJOCO_GL`` names the other.

There is no second try: PyOpenGL binds the process to the first one asked for."""

DRIVER_SECONDS = 60.0
"""The longest that a driver may take to tell its name [s]."""

_SUCCESS = 0
_STRUCTURE_INSTANCE_CREATE_INFO = 1
_INSTANCE_CREATE_INFO_BYTES = 64
_MOST_DEVICES = 16
_PROPERTIES_BYTES = 4096  # VkPhysicalDeviceProperties has 824; drivers only ever write that much
_VERSION_OFFSET = 4  # of the driver, behind that of the interface
_NAME_OFFSET, _NAME_BYTES = 20, 256  # behind five 32-bit numbers


@contextlib.contextmanager
def quiet_terminal() -> Iterator[IO[bytes]]:
    """Send what native code writes to the terminal into a file, which is handed out for error messages.

    Native libraries write to the descriptors 1 and 2, past ``sys.stdout``: these are redirected and always put back.
    What other threads print meanwhile is lost.
    """
    libc = ctypes.CDLL(None)
    sys.stdout.flush()
    sys.stderr.flush()
    libc.fflush(None)
    with tempfile.TemporaryFile() as caught, contextlib.ExitStack() as undo:
        for descriptor in (1, 2):
            kept = os.dup(descriptor)
            undo.callback(os.close, kept)
            undo.callback(os.dup2, kept, descriptor)
            os.dup2(caught.fileno(), descriptor)
        # Where standard output is no terminal, C holds lines back: they must come out while they are caught.
        undo.callback(libc.fflush, None)
        yield caught


def vulkan_device() -> str | None:
    """Name of the first Vulkan device, or None: loader, driver or device is missing."""
    found = vulkan_driver()
    return found.device if found else None


class VulkanDriver(NamedTuple):
    """Name of a Vulkan device, and the version of its driver as that counts."""

    device: str
    version: int


def vulkan_driver() -> VulkanDriver | None:
    """The first Vulkan device with its driver, None where there is none.

    Filament ends the process where it finds no Vulkan, so this asks the loader itself.
    """
    try:
        vulkan = ctypes.CDLL("libvulkan.so.1")
    except OSError:
        return None
    with quiet_terminal():
        return _first_device(vulkan)


def _first_device(vulkan: ctypes.CDLL) -> VulkanDriver | None:
    create_info = ctypes.create_string_buffer(_INSTANCE_CREATE_INFO_BYTES)
    create_info[0] = bytes([_STRUCTURE_INSTANCE_CREATE_INFO])
    instance = ctypes.c_void_p()
    if vulkan.vkCreateInstance(create_info, None, ctypes.byref(instance)) != _SUCCESS:
        return None
    try:
        count, devices = ctypes.c_uint32(_MOST_DEVICES), (ctypes.c_void_p * _MOST_DEVICES)()
        found = vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), devices)
        if found < _SUCCESS or count.value == 0:
            return None
        properties = ctypes.create_string_buffer(_PROPERTIES_BYTES)
        vulkan.vkGetPhysicalDeviceProperties(ctypes.c_void_p(devices[0]), properties)
        name = properties.raw[_NAME_OFFSET : _NAME_OFFSET + _NAME_BYTES].split(b"\0")[0].decode(errors="replace")
        return VulkanDriver(name, int.from_bytes(properties.raw[_VERSION_OFFSET : _VERSION_OFFSET + 4], sys.byteorder))
    finally:
        vulkan.vkDestroyInstance(instance, None)


def require_vulkan() -> None:
    """Raise ``RendererError`` where no Vulkan device is to be had."""
    if vulkan_device() is None:
        raise RendererError(
            "renderer 'filament' found no Vulkan device: install the Debian packages "
            f"{VULKAN_PACKAGES} ('refseq doctor' tells more), or choose {others_than(RendererKind.FILAMENT)}"
        )


class GlDevice(NamedTuple):
    """Device that draws for ``classic``, the version of GL with its driver's, and the way to it."""

    renderer: str
    version: str
    backend: str


def gl_device() -> GlDevice | None:
    """The device that ``classic`` gets, None where it gets none.

    A second process asks: a broken driver ends the one that tries it, and others bind it for good.
    """
    try:
        run = subprocess.run(
            [sys.executable, "-m", __name__], capture_output=True, text=True, timeout=DRIVER_SECONDS, check=True
        )
    except (subprocess.SubprocessError, OSError):
        return None
    lines = run.stdout.splitlines()
    return GlDevice(*lines) if len(lines) == len(GlDevice._fields) else None


def gl_backend() -> str | None:
    """Name of the way to a GL context that ``classic`` takes, or None where it does not work."""
    with contextlib.suppress(RendererError):
        name, context = open_gl(16, 16)
        context.free()
        return name
    return None


def open_gl(width: int, height: int) -> tuple[str, Any]:
    """A GL context without a screen: its backend's name and MuJoCo's context object.

    MuJoCo itself reads ``MUJOCO_GL`` once, when it is imported; asking its backends directly spares the user that.
    Raises ``RendererError``.
    """
    name = _gl_name()
    try:
        with quiet_terminal():
            context = _gl_module(name).GLContext(width, height)
            context.make_current()
    except Exception as error:  # missing libraries and drivers show as errors of many kinds
        raise RendererError(
            f"renderer 'classic' found no GL ({name}: {_one_line(error)}): install the Debian packages {GL_PACKAGES}, "
            "or libosmesa6 and set MUJOCO_GL=osmesa ('refseq doctor' tells more), or choose "
            f"{others_than(*BY_OPENGL)}"
        ) from error
    return name, context


def _gl_name() -> str:
    asked = os.environ.get("MUJOCO_GL", "").strip().lower()
    return asked if asked in GL_BACKENDS else GL_BACKENDS[0]


def _gl_module(name: str) -> ModuleType:
    # MuJoCo refuses where PyOpenGL is set to another platform, but one that was never loaded binds nothing yet.
    if "OpenGL" not in sys.modules:
        os.environ["PYOPENGL_PLATFORM"] = name
    return importlib.import_module(f"mujoco.{name}")


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _print_gl_device() -> None:
    backend, _context = open_gl(16, 16)
    from OpenGL import GL

    print(*(GL.glGetString(name).decode() for name in (GL.GL_RENDERER, GL.GL_VERSION)), backend, sep="\n")


if __name__ == "__main__":
    _print_gl_device()
