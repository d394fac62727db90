"""Who is answered: names of hosts, origins and tokens."""

from __future__ import annotations

import pytest

from teamsight.live.security import Access, access_to

_OPEN = {"origin": "http://127.0.0.1:80", "site": "same-origin", "is_socket": True}


@pytest.mark.parametrize("host", ["127.0.0.1:8713", "localhost:9", "[::1]:8713", "127.9.9.9", "LOCALHOST:8713"])
def test_pages_of_this_computer_are_answered(host: str) -> None:
    access = access_to("127.0.0.1", None)
    assert access.refusal("/", host, None, "none", is_socket=False) == ""
    assert access.refusal("/socket", host, f"http://{host}", "same-origin", is_socket=True) == ""


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8713", "127.0.0.1.evil.example", "", "localhost@evil", "127.0.0.1:8713/", "192.168.0.4", "a b"]
)  # fmt: skip
def test_names_of_others_are_refused(host: str) -> None:
    """Else a page of a site whose name leads here would be of the same origin (DNS rebinding)."""
    assert "Host" in access_to("127.0.0.1", None).refusal("/", host, None, None, is_socket=False)


def test_a_request_without_a_host_is_refused() -> None:
    assert "Host" in access_to("127.0.0.1", None).refusal("/", None, None, None, is_socket=False)


@pytest.mark.parametrize(
    ("origin", "site"),
    [
        ("http://evil.example", None), ("null", None), (None, None), ("http://127.0.0.1:9999", None), ("", None),
        ("http://127.0.0.1:8713.evil.example", None), ("file://", None), ("http://127.0.0.1:8713", "cross-site"),
        ("http://localhost:8713", None),
    ],
)  # fmt: skip
def test_sockets_from_other_pages_are_refused(origin: str | None, site: str | None) -> None:
    access = access_to("127.0.0.1", None)
    assert access.refusal("/socket", "127.0.0.1:8713", origin, site, is_socket=True)


def test_the_token_is_asked_for_everywhere() -> None:
    access = access_to("0.0.0.0", "a-word-of-mine")
    for path in ("/", "/?token=", "/?token=a-word-of-min", "/?token=A-WORD-OF-MINE", "/?tokens=a-word-of-mine", "/?token=%F0%9F"):
        assert "token" in access.refusal(path, "10.0.0.2:8713", None, None, is_socket=False)
    assert access.refusal("/?token=a-word-of-mine", "10.0.0.2:8713", None, None, is_socket=False) == ""
    assert access.refusal("/?token=a-word-of-mine", "evil.example", None, None, is_socket=False)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.7", "::", "my-computer"])
def test_other_addresses_need_a_token(host: str) -> None:
    with pytest.raises(ValueError, match=r"host='.*': can be reached from other computers.*--token"):
        access_to(host, None)
    made = {access_to(host, "").token for _ in range(3)}
    assert len(made) == 3
    assert all(len(one or "") >= 20 for one in made)


@pytest.mark.parametrize("token", ["short", "with space here", "ünïcode-token", "x" * 201, "a&b=c-d-e-f"])
def test_tokens_must_be_words(token: str) -> None:
    with pytest.raises(ValueError, match="8 to 200 letters"):
        access_to("127.0.0.1", token)


def test_hosts_must_be_texts() -> None:
    with pytest.raises(TypeError, match="host=None"):
        access_to(None, None)  # type: ignore[arg-type]
    assert access_to("127.0.0.1", None) == Access("127.0.0.1", None)
