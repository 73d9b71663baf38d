"""Tracks as a project of BORIS (``.boris``, project format 7.0, which BORIS 7 to 9 open)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.formats.track_text import plain_times
from forcelab.labels import Track
from forcelab.vocabulary import Vocabulary

__all__ = ["Observation", "VideoFile", "to_boris"]

#: The version of the format, which is not that of the program.
FORMAT_VERSION = "7.0"
#: The independent variable that says whose labels they are; a column of BORIS' tables.
OBSERVER = "observer"
#: BORIS plays up to so many files beside each other.
PLAYERS = 8


@dataclass(frozen=True, slots=True)
class VideoFile:
    """A video of an observation."""

    path: Path
    clock: ClockMap  #: maps force time to the video's
    fps: float = 0.0  #: as the file states; 0 where it is not known, as `seconds` is
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Observation:
    """What one coder labelled in one demonstration."""

    name: str  #: of the demonstration; BORIS lists it with the author's
    task: str  #: becomes the description
    track: Track
    videos: tuple[VideoFile, ...] = ()  #: without any BORIS has a live observation
    begun: datetime | None = None  #: when the coder began


def to_boris(name: str, observations: Sequence[Observation], vocabulary: Vocabulary) -> bytes:
    """A BORIS project: each observation of one, each segment a state event.

    Times are seconds of the force clock; where there is a video whose clock runs at another rate
    they go on at that one, so that BORIS shows the right frames. Further videos play beside the
    first one, as far as BORIS has players: from when they begin, and at its rate. The vocabulary's
    colours and keys become the ethogram.
    """
    labelled = dict.fromkeys(
        s.action for observation in observations for s in observation.track.segments
    )
    for code in labelled:
        if "|" in code:
            raise InputError(
                f"The action {code!a} holds a '|', which BORIS cannot hold; rename it."
            )
    actions = [action for action in vocabulary.with_actions(*labelled) if action.name in labelled]
    content = {
        "time_format": "s",
        "project_date": _date(datetime.now().astimezone()),
        "project_name": name,
        "project_description": "Labels of forcelab; times are seconds from the start of the forces",
        "project_format_version": FORMAT_VERSION,
        "subjects_conf": {},
        "behaviors_conf": {
            str(number): _behaviour(action.name, action.key, action.colour)
            for number, action in enumerate(actions)
        },
        "behavioral_categories": [],
        "behavioral_categories_config": {},
        "independent_variables": {
            "0": {
                "label": OBSERVER,
                "description": "",
                "type": "text",
                "default value": "",
                "possible values": "",
            }
        },
        "coding_map": {},
        "behaviors_coding_map": [],
        "converters": {},
        "observations": dict(zip(_ids(observations), map(_observation, observations), strict=True)),
    }
    return json.dumps(content, ensure_ascii=True, indent=1).encode()


def _behaviour(code: str, key: str, colour: str) -> dict[str, Any]:
    """An action as an entry of the ethogram."""
    return {
        "type": "State event",
        "key": key,
        "code": code,
        "description": "",
        "color": colour,
        "category": "",
        "modifiers": {},
        "excluded": "",
        "coding map": "",
    }


def _ids(observations: Iterable[Observation]) -> list[str]:
    """Unique names of the observations."""
    ids: dict[str, None] = {}
    for observation in observations:
        name = new = f"{observation.name} - {observation.track.author}".strip()
        number = 2
        while new in ids:
            new, number = f"{name} ({number})", number + 1
        ids[new] = None
    return list(ids)


def _observation(observation: Observation) -> dict[str, Any]:
    videos = observation.videos[:PLAYERS]
    clock = videos[0].clock if videos else ClockMap()
    # Neither subject nor modifier nor comment; where there is a video its frame, which may be open.
    rest = ["", "", "NA"] if videos else ["", ""]
    events = [
        [_video_time(time, clock), "", segment.action, *rest]
        for segment, times in plain_times(observation.track)
        for time in times
    ]
    common = {
        "date": _date(observation.begun),
        "description": observation.task,
        "time offset": float(clock.offset),
        "events": events,
        "observation time interval": [0, 0],
        "independent_variables": {OBSERVER: observation.track.author},
        "visualize_spectrogram": False,
        "visualize_waveform": False,
        "media_creation_date_as_offset": False,
        "media_scan_sampling_duration": 0,
        "image_display_duration": 1,
        "close_behaviors_between_videos": False,
    }
    if not videos:
        live = {"scan_sampling_time": 0, "start_from_current_time": False}
        live["start_from_current_epoch_time"] = False
        return {"type": "LIVE", "file": {}, **common, **live}
    files: dict[str, list[str]] = {str(player): [] for player in range(1, PLAYERS + 1)}
    for player, video in enumerate(videos, 1):
        files[str(player)] = [str(video.path)]
    info = {
        "length": {str(video.path): video.seconds for video in videos},
        "fps": {str(video.path): video.fps for video in videos},
        "hasVideo": {str(video.path): True for video in videos},
        "hasAudio": {str(video.path): False for video in videos},
        # When each begins, on the clock of the first one.
        "offset": {
            str(player): round(float(clock.to_device(video.clock.offset)), 6)
            for player, video in enumerate(videos, 1)
        },
        "display": {str(video.path): "Nothing" for video in videos},
    }
    return {"type": "MEDIA", "file": files, "media_info": info, **common}


def _video_time(time: float, clock: ClockMap) -> float:
    """A force time, counted at the video's rate from where the video begins."""
    return round(float(clock.to_device(time)) + float(clock.offset), 6)


def _date(when: datetime | None) -> str:
    """A local date and time as BORIS writes them."""
    if when is None:
        return ""
    with suppress(OverflowError, ValueError):  # a year that has no local time on this machine
        when = when.astimezone()
    return when.replace(tzinfo=None).isoformat(timespec="milliseconds")
