import datetime
from dataclasses import replace
from typing import Any

import pytest

from refseq_bench.worlds.errors import LightError
from refseq_bench.worlds.light import PRESETS, Lamps, LightSetting, clock_text, light_named

SUMMER = datetime.date(2008, 6, 15)
DAY = "a day such as 2008-06-15, in the years 1900 to 2100"
FORM = "HH:MM with any of cloud=0..1, lamps=auto|on|off, date=YYYY-MM-DD after it, commas between"


@pytest.mark.parametrize(
    ("text", "setting"),
    [
        ("17:45", LightSetting("17:45", 17.75)),
        ("late-evening", LightSetting("late-evening", 21.5)),
        ("overcast,lamps=on", LightSetting("overcast,lamps=on", 13.0, cloud=1.0, lamps=Lamps.ON)),
        ("overcast,cloud=0.2", LightSetting("overcast,cloud=0.2", 13.0, cloud=0.2)),
        (
            "6:00,cloud=0.5,lamps=off,date=2008-06-15",
            LightSetting("6:00,cloud=0.5,lamps=off,date=2008-06-15", 6.0, 0.5, Lamps.OFF, SUMMER),
        ),
    ],
)
def test_any_hour_is_a_light(text: str, setting: LightSetting) -> None:
    assert light_named(text) == setting


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("dusk", f"unknown light 'dusk'; known are morning, noon, 16:00, 18:00, overcast, late-evening, or {FORM}"),
        ("24:30", f"unknown light '24:30'; known are morning, noon, 16:00, 18:00, overcast, late-evening, or {FORM}"),
        ("12:00,fog=1", f"light '12:00,fog=1': unknown option 'fog=1'; valid is {FORM}"),
        ("12:00,cloud=2", "light '12:00,cloud=2': cloud '2' is not valid; it should be a share from 0 to 1"),
        ("12:00,cloud=nan", "light '12:00,cloud=nan': cloud 'nan' is not valid; it should be a share from 0 to 1"),
        ("noon,lamps=dim", "light 'noon,lamps=dim': lamps 'dim' is not valid; it should be auto, on or off"),
        ("noon,date=1 May", f"light 'noon,date=1 May': date '1 May' is not valid; it should be {DAY}"),
        (
            "24:00,date=9999-12-31",
            f"light '24:00,date=9999-12-31': date '9999-12-31' is not valid; it should be {DAY}",
        ),
        ("overcast,cloud=0.2,cloud=1", "light 'overcast,cloud=0.2,cloud=1': cloud is given twice; valid is once"),
    ],
)
def test_what_is_no_light(text: str, message: str) -> None:
    with pytest.raises(LightError) as caught:
        light_named(text)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"hour": 24.5}, "hour '24.5' is not valid; it should be from 0 to 24"),
        ({"hour": float("nan")}, "hour 'nan' is not valid; it should be from 0 to 24"),
        ({"cloud": -0.1}, "cloud '-0.1' is not valid; it should be a share from 0 to 1"),
        ({"lamps": "on"}, "lamps 'on' is not valid; it should be Lamps.AUTO, ON or OFF"),
        ({"date": datetime.date.min}, f"date '0001-01-01' is not valid; it should be {DAY}"),
    ],
)
def test_a_setting_that_is_made_by_hand_is_checked_too(given: dict[str, Any], said: str) -> None:
    with pytest.raises(LightError) as caught:
        LightSetting(**{"name": "mine", "hour": 12.0, **given})
    assert str(caught.value) == f"light 'mine': {said}"


@pytest.mark.parametrize(
    "text", [*PRESETS, "07:05,cloud=0.3,lamps=off,date=2008-06-15", "24:00", "0:00,lamps=on", "noon,cloud=0.25"]
)
def test_a_light_is_read_back_from_its_text(text: str) -> None:
    light = light_named(text)
    assert replace(light_named(light.as_text()), name=text) == light


def test_clock_of_the_last_half_minute_is_the_next_hour() -> None:
    assert [clock_text(hour) for hour in (9.0, 9.25, 9.9999, 23.9999)] == ["09:00", "09:15", "10:00", "24:00"]
