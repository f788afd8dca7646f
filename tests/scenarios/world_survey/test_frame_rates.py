import pytest

from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.world_survey import frame_rates
from refseq_bench.scenarios.world_survey.frame_rates import frame_rate
from refseq_bench.sim.errors import RendererError
from refseq_bench.sim.rendering.drivers import gl_backend
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.errors import WorldsError


@pytest.mark.slow
@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
def test_the_first_view_takes_longer_than_a_picture():
    rate = frame_rate(Drive(world="lamp", renderer=RendererKind.CLASSIC))
    assert rate.renderer is RendererKind.CLASSIC
    assert 0 < rate.frame < rate.first


def test_a_renderer_that_does_not_start_is_left_out(monkeypatch):
    def opened(drive):
        if drive.renderer is RendererKind.FILAMENT:
            raise RendererError("no Vulkan device")
        return drive.renderer

    monkeypatch.setattr(frame_rates, "frame_rate", opened)
    assert list(frame_rates.frame_rates("lamp", "16:00")) == [RendererKind.BAKED, RendererKind.CLASSIC]


def test_an_unknown_world_is_told():
    with pytest.raises(WorldsError, match="nowhere"):
        list(frame_rates.frame_rates("nowhere", "16:00"))
