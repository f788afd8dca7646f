"""Strangers and guests at the door, by the headers of a request."""

import pytest

from refseq.access.policy import AccessPolicy
from refseq.errors import RefseqError

TOKEN = "0123456789abcdef"


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.7", "robot.local", "::"])
def test_others_reach_it_with_a_token_only(host: str) -> None:
    with pytest.raises(RefseqError, match=f"host '{host}' is reached from other machines; valid is --token"):
        AccessPolicy(host)
    access = AccessPolicy(host, token=TOKEN)
    assert access.reason_against([f"{host}:8765"], [], [""]).startswith("the token of the address is missing")
    assert access.reason_against([f"{host}:8765"], [], ["", TOKEN]) == ""


def test_a_token_is_drawn_where_none_is_given() -> None:
    one, other = AccessPolicy(), AccessPolicy()
    assert len(one.token) >= 32
    assert one.token != other.token


@pytest.mark.parametrize(
    ("host", "authority"),
    [
        ("127.0.0.1", "127.0.0.1:8765"),
        ("robot.local", "robot.local:8765"),
        ("::1", "[::1]:8765"),
        ("fe80::1%eth0", "[fe80::1%eth0]:8765"),
    ],
)
def test_an_address_has_a_number_of_ipv6_in_brackets(host: str, authority: str) -> None:
    assert AccessPolicy(host, token=TOKEN).authority(8765) == authority


@pytest.mark.parametrize("token", ["short", "with a space in it", "slash/slash/slash/", "ümläutümläutümläut"])
def test_a_token_is_long_and_plain(token: str) -> None:
    with pytest.raises(RefseqError, match="valid are 16 or more, letters and digits"):
        AccessPolicy(token=token)


@pytest.mark.parametrize("host", ["localhost:8765", "127.0.0.1", "127.0.0.1:8765", "[::1]:8765"])
def test_programs_of_this_machine_get_in_with_the_token(host: str) -> None:
    access = AccessPolicy(token=TOKEN)
    assert access.reason_against([host], [], [TOKEN]) == ""
    for given in ([], [""], [TOKEN[:-1]], [TOKEN + "0"], ["\udce4" * 16]):
        assert access.reason_against([host], [], given) == "the token of the address is missing or wrong"


@pytest.mark.parametrize(
    "hosts",
    [
        *([one] for one in ("evil.example", "127.0.0.1.evil.example", "", "[", "localhost.evil.example:8765")),
        *([one] for one in ("a@127.0.0.1", "127.0.0.1/../evil", "127.0.0.1 evil", "127.0.0.1#", "evil\\@127.0.0.1")),
        [],
        ["localhost", "localhost"],
    ],
)
def test_other_names_of_this_machine_do_not_come_in(hosts: list[str]) -> None:
    assert AccessPolicy(token=TOKEN).reason_against(hosts, [], [TOKEN]) == "the address is not this machine's"


@pytest.mark.parametrize(
    "origins",
    [
        *([one] for one in ("https://evil.example", "null", "", "http://localhost:8766", "https://localhost:8765")),
        ["http://localhost:8765", "http://localhost:8765"],
        ["https://own.example.evil.example"],
    ],
)
def test_pages_of_others_do_not_come_in(origins: list[str]) -> None:
    access = AccessPolicy(token=TOKEN, origins=("https://own.example",))
    assert access.reason_against(["localhost:8765"], origins, [TOKEN]).startswith("pages of ")
    for own in ("https://own.example", "http://localhost:8765"):
        assert access.reason_against(["localhost:8765"], [own], [TOKEN]) == ""


@pytest.mark.parametrize(
    "origin",
    ["", "example.org", "https://", "https://a.example/", "https://a.example/page", "https://A.example", "null", "*"],
)
def test_an_origin_that_no_browser_sends_is_told(origin: str) -> None:
    with pytest.raises(RefseqError) as caught:
        AccessPolicy(token=TOKEN, origins=("http://good.example:8080", origin))
    assert str(caught.value) == f"origin {origin!r} is not valid; valid is one as https://example.org, no path"


@pytest.mark.parametrize(
    "origin", ["https://a.example", "http://[::1]:9090", "http://localhost:3000", "app://foxglove"]
)
def test_an_origin_that_is_one_lets_its_page_in(origin: str) -> None:
    access = AccessPolicy(token=TOKEN, origins=(origin,))
    assert access.reason_against(["127.0.0.1:1"], [origin], [TOKEN]) == ""
    assert access.reason_against(["127.0.0.1:1"], [f"{origin}x"], [TOKEN]) != ""
