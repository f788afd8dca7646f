import io

from rich.console import Console

from refseq_bench.scenarios.heartbeat import PERIOD, Heartbeat


def test_a_line_is_said_after_a_silence_and_never_sooner() -> None:
    now = 0.0
    console = Console(file=io.StringIO(), width=20)
    heartbeat = Heartbeat(console, lambda: now)

    def state() -> str:
        return f"at {now:.0f} s, in a line that is wider than the console"

    for second in range(60):
        now = float(second)
        if second == 34:
            heartbeat.say("news of step [3]")
        heartbeat.beat(state)
    said = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    assert [line.split(",")[0] for line in said] == [
        "at 10 s", "at 20 s", "at 30 s", "news of step [3]", "at 44 s", "at 54 s",
    ]  # fmt: skip
    assert PERIOD == 10
