"""The page: one self-contained HTML file that plays a recording, without network and without a server."""

from __future__ import annotations

import base64
import binascii
import hashlib
import html
import json
import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from teamsight.core.files import UnwritableError, check_name, check_place, complete, open_regular, unwritable
from teamsight.core.version import __version__
from teamsight.view.packing import pack, unpack
from teamsight.view.scene import Frame, Scene

#: How a page begins; by this it is known as teamsight's.
MARK = "<!doctype html>\n<!-- written by teamsight"

_DATA = '<script type="application/json" id="replay">'
_END = "</script>"
# Previews of mail programs and file managers run no scripts.
_SILENT = "This recording plays in a browser that runs scripts; open the file there."
_ASSETS = Path(__file__).parent / "assets"


class Track(Protocol):
    """One scene and its frames."""

    @property
    def scene(self) -> Scene:
        """What does not change from frame to frame."""

    @property
    def frames(self) -> Sequence[Frame]:
        """The frames, in order of time."""


class Panel(NamedTuple):
    """What a page has beside its tracks.

    Attributes
    ----------
    style, script : str
        Texts of `asset`; the script runs after that of the page.
    data : str
        JSON that the script reads from the element ``#panel``.
    """

    style: str
    script: str
    data: str


def page(tracks: Sequence[Track], *, title: str, panel: Panel | None = None) -> str:
    """Return the page that plays tracks side by side.

    Parameters
    ----------
    tracks : sequence of Track
        What to play: one or two.
    title : str
        The title of the page.
    panel : Panel, optional
        What it shows beside them.
    """
    scripts, styles = [asset("view.js")], [asset("view.css")]
    more = ""
    if panel is not None:
        scripts.append(panel.script)
        styles.append(panel.style)
        more = f'<script type="application/json" id="panel">{_inert(panel.data)}{_END}\n'
    known = [" ".join(map(digest, each)) for each in (scripts, styles)]
    policy = f"default-src 'none'; script-src {known[0]}; style-src {known[1]}; img-src data: blob:"
    return (
        f"{MARK} {__version__}: a recording that plays in any browser -->\n"
        '<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n{''.join(f'<style>{one}</style>' for one in styles)}</head>\n"
        f'<body><main id="teamsight"></main>\n<noscript>{_SILENT}</noscript>\n'
        f"{_DATA}{_json(tracks)}{_END}\n{more}{''.join(f'<script>{one}{_END}' for one in scripts)}</body></html>\n"
    )


def tracks_in(text: str) -> list[tuple[Scene, list[Frame]]]:
    """Return the scenes and frames of a page that `page` has made.

    Raises
    ------
    ValueError
        If it is another page, or damaged.
    """
    start = text.find(_DATA)
    end = text.find(_END, start)
    if not text.startswith(MARK) or start < 0 or end < 0:
        raise ValueError("is not a recording of teamsight; give a page that World.record or replay.save wrote")
    try:
        value = json.loads(text[start + len(_DATA) : end])
        found = []
        for track in value["tracks"]:
            scene = Scene.from_json(track["scene"])
            found.append((scene, unpack(base64.b64decode(track["frames"], validate=True), scene)))
    except (KeyError, TypeError, RecursionError, json.JSONDecodeError, binascii.Error) as error:
        raise ValueError(f"is damaged ({type(error).__name__}: {error}); record the run again") from error
    return found


@cache
def asset(name: str, folder: Path | None = None) -> str:
    """Return the text of a script or a style, such as ``view.js``."""
    text = ((folder or _ASSETS) / name).read_text("utf-8")
    # A browser would read other line ends as \n, and then the digest would be another; and it would end the element.
    if "\r" in text or _END[:-1] in text.lower() or "</style" in text.lower():
        raise ValueError(f"{name}: must not contain carriage returns, {_END} or </style>; write them in another way")
    return text


def digest(text: str) -> str:
    """Return the digest of a script or style as a Content-Security-Policy names it, with quotation marks."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _json(tracks: Sequence[Track]) -> str:
    """Return tracks as JSON for an element of a page."""
    value: list[dict[str, Any]] = []
    for track in tracks:
        # The frames first: a recording that still grows may add slots to the scene meanwhile.
        frames = list(track.frames)
        scene = track.scene
        packed = base64.b64encode(pack(frames, scene)).decode()
        value.append({"scene": scene.as_json(), "frames": packed})
    return _inert(json.dumps({"tracks": value}, ensure_ascii=False, allow_nan=False, separators=(",", ":")))


def _inert(text: str) -> str:
    """Return a text of JSON in which no element can end or begin."""
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


#: The mark in films and pictures.
SOFTWARE = "teamsight"
# Films and pictures: how they begin, where, and the mark. All have it in their first or last bytes.
_KINDS = (
    (0, MARK.encode(), MARK.encode()),
    (0, b"\x89PNG\r\n\x1a\n", b"Software\0" + SOFTWARE.encode()),
    (0, b"GIF8", SOFTWARE.encode()),
    (4, b"ftyp", SOFTWARE.encode()),
)
_ENDS = 100_000


def check_replaceable(path: str | os.PathLike[str], *, force: bool = False) -> None:
    """Raise an error if a file must not be replaced: one that is no recording of teamsight.

    Parameters
    ----------
    path : path
        Where the file is to be.
    force : bool
        Replace any regular file.

    Raises
    ------
    ValueError
        If it must not be replaced, or cannot be written.
    """
    check_name(path)
    folder = os.path.dirname(os.fspath(path)) or "."
    if not os.path.isdir(folder):
        raise UnwritableError(f"{os.fspath(path)}: cannot be written (there is no folder {folder}); make it first")
    if check_place(path) and not force and not _is_own(path):
        raise ValueError(
            f"{os.fspath(path)}: holds something else; give --force (in Python, force=True) to replace it, or another "
            "place"
        )


def write(path: str | os.PathLike[str], content: bytes, *, force: bool = False) -> None:
    """Write a recording; see `check_replaceable`."""
    with complete(path, lambda target: check_replaceable(target, force=force)) as draft:
        draft.write(content)


def _is_own(path: str | os.PathLike[str]) -> bool:
    """Whether a file is a recording of teamsight."""
    try:
        with open_regular(path) as file:
            head = file.read(_ENDS)
            file.seek(max(os.fstat(file.fileno()).st_size - _ENDS, 0))
            content = head + file.read(_ENDS)
    except OSError as error:
        raise unwritable(path, error) from error
    return any(head[at:].startswith(start) and mark in content for at, start, mark in _KINDS)
