"""What tests begin with: demonstrations, videos, tracks, projects, runs and their settings.

Programs that tests start import this too: no pytest here, and OpenCV, PyAV and scikit-learn are
loaded only by what needs them.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.formats import pdl, read
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.jobs import Progress, finish
from forcelab.labels import Segment, Segments, Track
from forcelab.project import LabelsUsed, NewDemonstration, Project, Provenance
from forcelab.project.track_editor import TrackEditor
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.metrics import count_segments, pool
from forcelab.recognition.presets import preset
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.results import DemonstrationResult
from forcelab.recognition.settings import Settings
from forcelab.review.run_result import RunResult
from forcelab.simulation.scene import Body, Event, Jaws, Motion, Performance, Scene
from forcelab.video.codecs import opencv
from forcelab.vocabulary import Vocabulary

#: Where folders lie in memory: most tests are not about the disk, for which every commit waits.
MEMORY_FOLDER = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


@contextmanager
def folder_in_memory() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(dir=MEMORY_FOLDER) as folder:
        yield Path(folder)


def blas_threads() -> list[int]:
    """How many threads each BLAS that is loaded may use; OpenCV's, which nothing needs, aside."""
    from threadpoolctl import threadpool_info

    return [
        pool["num_threads"]
        for pool in threadpool_info()
        if pool["user_api"] == "blas" and "opencv" not in pool["filepath"]
    ]


def read_single(path: Path, **options: object) -> Recording:
    """The only recording of a file."""
    (recording,) = read(path, ReadOptions(**options))  # type: ignore[arg-type]
    return recording


def refusal(path: Path, error: type[InputError] = InputError, **options: object) -> str:
    """The sentence for which a file is refused: one line that names it."""
    with pytest.raises(error) as caught:
        read(path, ReadOptions(**options))  # type: ignore[arg-type]
    sentence = str(caught.value)
    assert path.name in sentence
    assert sentence.endswith(".")
    assert "\n" not in sentence
    return sentence


def channel_names(recording: Recording) -> list[str]:
    return [channel.name for channel in recording.demonstration.channels]


def rounded_segments(recording: Recording) -> dict[str, list[tuple[float, float, str]]]:
    """Start, end and action of the labels of each author, to the microsecond."""
    return {
        track.author: [(round(s.start, 6), round(s.end, 6), s.action) for s in track.segments]
        for track in recording.tracks
    }


def action_at(segments: Segments, time: float) -> str | None:
    return next((s.action for s in segments if s.start <= time < s.end), None)


def cached_project(make: Callable[..., object], path: Path, *arguments: Hashable) -> Path:
    """The folder that ``make(path, *arguments)`` would make, which only the first call does."""
    path.mkdir()
    for name, content in _content_of_project(make, arguments):
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(content) if content is not None else (path / name).mkdir()
    return path


@lru_cache(maxsize=64)
def _content_of_project(
    make: Callable[..., object], arguments: tuple[Hashable, ...]
) -> tuple[tuple[Path, bytes | None], ...]:
    """All files by their place in the folder; None for a folder."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "project"
        make(path, *arguments)
        return tuple(
            (place.relative_to(path), place.read_bytes() if place.is_file() else None)
            for place in sorted(path.rglob("*"))
        )


# Demonstrations

Real = NDArray[np.float64]

#: What happens in a synthetic demonstration, in this order; it ends with `still` as it began.
SYNTHETIC_ACTIONS = ("still", "grab", "hold", "release")
#: Forces of two sensors; the normals are negative in compression.
SYNTHETIC_CHANNELS = tuple(Channel(f"f{axis}{sensor}", "N") for sensor in (1, 2) for axis in "xyz")
#: Newtons a count: lateral, lateral, normal.
SYNTHETIC_RESOLUTION = np.array([1 / 800, 1 / 800, 1 / 160] * 2)


@dataclass(frozen=True)
class _Motion:
    """What one person did: seconds at which the actions change, and forces in newtons."""

    changes: Real
    grip: float
    share: Real
    load: Real
    swing: float
    relaxed: float

    @classmethod
    def drawn(cls, random: np.random.Generator) -> _Motion:
        """A person's durations and forces: no two demonstrations are alike."""
        low = np.array([0.8, 0.2, 0.9, 0.2, 0.8])
        high = np.array([1.9, 0.6, 1.7, 0.5, 1.7])
        angle = random.uniform(-np.pi, np.pi) + np.array([0.0, random.normal(np.pi, 0.4)])
        size = random.uniform(0.8, 3.0) * np.array([1.0, random.uniform(0.4, 0.9)])
        return cls(
            changes=np.concatenate([[0.0], np.cumsum(random.uniform(low, high))]),
            grip=random.uniform(4.0, 12.0),
            share=np.array([1.0, random.uniform(0.75, 1.0)]),
            load=np.stack([size * np.cos(angle), size * np.sin(angle)]),
            swing=random.uniform(0.02, 0.08),
            relaxed=random.uniform(0.08, 0.2),
        )


def _smooth_step(t: Real, start: float, end: float) -> Real:
    """From 0 at `start` to 1 at `end` with the least jerk, as hands move."""
    s = np.clip((t - start) / (end - start), 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def _forces(t: Real, motion: _Motion, random: np.random.Generator) -> Real:
    """What ideal sensors would read, shape (n, 6), in newtons."""
    _, grab, hold, release, rest, _ = motion.changes
    closing, opening = _smooth_step(t, grab, hold), _smooth_step(t, release, rest)
    gives_way = 1 - motion.relaxed * (1 - np.exp(-np.maximum(t - hold, 0.0) / 0.4))
    grip = motion.grip * closing * gives_way * (1 - opening)
    # The block's weight comes onto the tips late in the grab and leaves them early in the release.
    middle_grab, middle_release = 0.5 * (grab + hold), 0.5 * (release + rest)
    lifted = _smooth_step(t, middle_grab, hold + 0.15) * (
        1 - _smooth_step(t, release, middle_release)
    )
    swing = 1 + motion.swing * np.sin(2 * np.pi * (t - hold) * random.uniform(1.0, 2.0))
    pitch = random.uniform(8.0, 12.0) * t + 0.15 * np.sin(2 * np.pi * random.uniform(0.3, 0.8) * t)
    tremor = 1 + 0.012 * np.sin(2 * np.pi * (pitch + random.uniform()))
    out = np.empty((len(t), 6))
    for sensor in range(2):
        out[:, 3 * sensor : 3 * sensor + 2] = np.outer(lifted * swing, motion.load[:, sensor])
        out[:, 3 * sensor + 2] = -motion.share[sensor] * grip * tremor
    return out


def _sensed(t: Real, forces: Real, random: np.random.Generator) -> Real:
    """The same with creeping zeros, noise of 5 to 15 mN, in whole counts."""
    zero = random.normal(0.0, 0.08, 6)
    creep = random.normal(0.0, 0.03, 6) * (t / t[-1])[:, np.newaxis] ** 0.5
    noise = random.uniform(0.005, 0.015, 6) * random.standard_normal(forces.shape)
    return np.round((forces + zero + creep + noise) / SYNTHETIC_RESOLUTION) * SYNTHETIC_RESOLUTION


def _labels(motion: _Motion, random: np.random.Generator) -> Segments:
    """A coder's segments: edges off by some 15 ms, about 50 ms between two left unlabelled."""
    segments = []
    for number, (start, end) in enumerate(pairwise(motion.changes.tolist())):
        left = start + random.uniform(0.0, 0.05) + abs(random.normal(0.0, 0.015))
        right = end - random.uniform(0.0, 0.05) + min(random.normal(0.0, 0.015), 0.0)
        action = SYNTHETIC_ACTIONS[number % len(SYNTHETIC_ACTIONS)]
        segments.append(Segment(round(left, 3), round(right, 3), action))
    return tuple(segments)


def synthetic_demonstration(
    seed: int, rate: float = 1000.0, task: str = "foam"
) -> tuple[Demonstration, Segments]:
    """Make one demonstration of the foam pick-up, with the segments a coder would give it.

    Tongs grab a foam block, hold it and let it go. Nothing here was recorded from a person. The
    numbers are of the size seen with two 3-axis optical force sensors in the tips of a pair of
    tongs: forces of a few newtons, white noise of a few millinewtons, a tremor that grows with the
    grip, foam that gives way, a zero that creeps.

    Parameters
    ----------
    seed : int
        The same seed gives the same demonstration; another rate the same motion.
    rate : float
        Samples a second.
    task : str
        The demonstration's task; it does not change the motion.

    Returns
    -------
    Demonstration
        3.3 to 6.4 s, six channels in newtons.
    tuple of Segment
        still, grab, hold, release, still, with short unlabelled stretches between.
    """
    motions, noises, coders = (np.random.default_rng([seed, part]) for part in range(3))
    motion = _Motion.drawn(motions)
    t = np.arange(int(motion.changes[-1] * rate)) / rate
    signals = _sensed(t, _forces(t, motion, motions), noises)
    demonstration = Demonstration(f"{task} {seed:02d}", task, t, signals, SYNTHETIC_CHANNELS)
    return demonstration, _labels(motion, coders)


def synthetic_set(
    count: int, rate: float = 1000.0, task: str = "foam", seed: int = 1
) -> list[tuple[Demonstration, Segments]]:
    """Make `count` demonstrations, with the seeds from `seed` on."""
    return [synthetic_demonstration(seed + i, rate, task) for i in range(count)]


def labelled_set(
    count: int, rate: float = 1000.0, task: str = "foam", seed: int = 1
) -> list[LabelledDemonstration]:
    """The same to learn from."""
    return [LabelledDemonstration(*pair) for pair in synthetic_set(count, rate, task, seed)]


def read_labelled(path: Path) -> list[LabelledDemonstration]:
    """The recordings of a database of the paper, to learn from."""
    recordings = pdl.read(path, ReadOptions())
    return [LabelledDemonstration(r.demonstration, r.tracks[0].segments) for r in recordings]


def make_track(*rows: tuple[float, float, str]) -> Segments:
    """Segments of rows (start, end, action)."""
    return tuple(Segment(*row) for row in rows)


def foam_demonstration() -> Demonstration:
    """Ten seconds at 100 Hz, from 0 to 10 s exactly."""
    times = np.arange(1000) / 100
    return Demonstration("01", "foam", times, np.sin(times)[:, np.newaxis], (Channel("fz", "N"),))


def sine_demonstration(name: str, task: str, shift: float = 0.0) -> Demonstration:
    """Ten seconds at 100 Hz of one 3-axis sensor."""
    times = np.arange(1000) / 100
    signals = np.sin(times[:, np.newaxis] + shift + np.arange(3))
    return Demonstration(name, task, times, signals, tuple(Channel(f"f{a}", "N") for a in "xyz"))


def quiet_demonstration() -> Demonstration:
    """Ten seconds at 1 kHz of nothing."""
    times, channels = np.arange(10_000) / 1000, (Channel("f"),)
    return Demonstration("pen 1", "stylus", times, np.zeros((10_000, 1)), channels)


# Videos

#: A video's frames carry their number as black and white blocks: its bits, and a block's side in
#: pixels.
NUMBER_BITS, NUMBER_BLOCK = 16, 24
VIDEO_WIDTH, VIDEO_HEIGHT = NUMBER_BITS * NUMBER_BLOCK, 64
VIDEO_TIME_BASE = Fraction(1, 90_000)
GOP_250 = {"g": "250", "keyint_min": "250", "sc_threshold": "0", "bf": "3", "preset": "veryfast"}


def even_frame_times(count, rate=30):
    """Times of a constant frame rate, s."""
    return np.arange(count) / rate


def uneven_frame_times(count, seed=0):
    """Times of a variable frame rate: 12 to 60 frames a second, and two long holes; s."""
    steps = np.random.default_rng(seed).uniform(1 / 60, 1 / 12, count)
    steps[[count // 3, count // 2]] = 0.9
    return np.round(np.cumsum(steps) / float(VIDEO_TIME_BASE)) * float(VIDEO_TIME_BASE)


def numbered_frame(number, size=(VIDEO_WIDTH, VIDEO_HEIGHT)):
    """A frame, shape (height, width, 3), that says its number."""
    image = np.full((size[1], size[0], 3), 96, np.uint8)
    image[:, :VIDEO_WIDTH] = 16
    for bit in range(NUMBER_BITS):
        if number >> bit & 1:
            image[:VIDEO_HEIGHT, bit * NUMBER_BLOCK : (bit + 1) * NUMBER_BLOCK] = 235
    return image


def frame_number(frame):
    """The number that a frame says."""
    levels = frame[VIDEO_HEIGHT // 2 - 6 : VIDEO_HEIGHT // 2 + 6, :VIDEO_WIDTH].mean(axis=(0, 2))
    middles = levels.reshape(NUMBER_BITS, NUMBER_BLOCK)[:, 6:18].mean(axis=1)
    return int(sum(1 << bit for bit in range(NUMBER_BITS) if middles[bit] > 128))


def write_video(path: Path, codec, times, options=None, size=(VIDEO_WIDTH, VIDEO_HEIGHT)):
    """Encode numbered frames with their times (s)."""
    import av

    # Matroska keeps milliseconds; the others as fine as they are told.
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=30)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        stream.options = options or {}
        stream.codec_context.thread_count = 1  # those of libvpx spin, for minutes on a busy machine
        stream.codec_context.time_base = VIDEO_TIME_BASE
        stream.time_base = VIDEO_TIME_BASE
        for number, time in enumerate(times):
            frame = av.VideoFrame.from_ndarray(numbered_frame(number, size), format="rgb24")
            frame.pts, frame.time_base = round(time / VIDEO_TIME_BASE), VIDEO_TIME_BASE
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def write_opencv_video(path: Path, fourcc, count):
    """Encode numbered frames as OpenCV does, at 30 frames a second."""
    cv2 = opencv()
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*fourcc), 30, (VIDEO_WIDTH, VIDEO_HEIGHT)
    )
    for number in range(count):
        writer.write(numbered_frame(number))
    writer.release()
    return path


#: Of `demonstration_with_video`: when on the force's clock the video begins, and the taps, s.
VIDEO_OFFSET, VIDEO_TAPS = -0.4, (0.5, 5.4)


def demonstration_with_video(folder: Path, clock: ClockMap | None = None) -> Demonstration:
    """Two channels with contacts and two taps, and a disc that jumps at each of them.

    `folder`: where the video is written; `clock`: what the demonstration believes; by default that
    video and force begin together.
    """
    cv2, length, frame_rate = opencv(), 6.0, 30.0
    contacts = (1.31, 1.87, 2.66, 3.05, 3.74, 4.49)
    rng = np.random.default_rng(5)
    t = np.arange(0.0, length, 1.0 / 500.0)
    force = 0.01 * rng.standard_normal((t.size, 2))
    for number, contact in enumerate(contacts):
        pressed = np.clip((t - contact) / 0.02, 0.0, 1.0)
        force[:, 1] += 2.0 * (-1) ** number * pressed
    for tap in VIDEO_TAPS:
        force[:, 0] += 4.0 * np.exp(-0.5 * ((t - tap) / 0.007) ** 2)
    frame_times = VIDEO_OFFSET + np.arange(0.0, length + 0.5, 1.0 / frame_rate)
    events = np.sort([*contacts, *VIDEO_TAPS])
    path = folder / "filmed.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), frame_rate, (320, 180))
    for time in frame_times:
        past = np.searchsorted(events, time)
        x = int(60 + 25 * past + 3 * np.sin(2 * time))
        picture = np.full((180, 320, 3), 60, dtype=np.uint8)
        cv2.circle(picture, (x, 90), 30, (90, 200, 220), -1)
        writer.write(picture)
    writer.release()
    return Demonstration(
        "filmed 1",
        "foam",
        t,
        force,
        (Channel("fx1", "N"), Channel("fz1", "N")),
        videos=(VideoReference(path, clock or ClockMap()),),
    )


# Simulated performances

#: When the jaws of a grip close, hold and open, s.
GRIP_TIMES = [0.0, 0.2, 0.3, 0.5, 0.6, 0.8]


def perform_grips(task, seed, numbers, taps):
    """Performances without mechanics: the seed and the number alone decide how strong a grip is."""
    rate, performances = 2000.0, []
    for number in numbers:
        yield Progress(len(performances), len(numbers), task)
        times = np.arange(round(GRIP_TIMES[-1] * rate) + 1) / rate
        strength = np.random.default_rng([seed, number]).uniform(3.0, 6.0)
        grip = strength * np.interp(times, GRIP_TIMES, [0, 0, 1, 1, 0, 0])
        jaw = 0.04 - np.interp(times, GRIP_TIMES, [0, 0.02, 0.021, 0.021, 0.02, 0])
        zero = np.zeros_like(times)
        motion = Motion(
            times=times,
            jaws=np.stack([jaw, jaw], axis=1),
            tongs=np.zeros((len(times), 3)),
            body=np.zeros((len(times), 4)),
            normal=np.stack([grip, grip], axis=1),
        )
        side = [0.3 * grip, zero, -grip]
        actions = [
            Segment(start, end, action)
            for start, end, action in zip(
                GRIP_TIMES,
                GRIP_TIMES[1:],
                ("still", "grab", "hold", "release", "still"),
                strict=False,
            )
        ]
        performances.append(
            Performance(
                scene=Scene(task, Jaws(), Body("block", 0.02, 0.02, 500.0)),
                motion=motion,
                forces=np.stack([*side, *side], axis=1),
                rate=rate,
                actions=tuple(actions),
                events=(Event(0.2, "left jaw: contact made"),),
                taps=(0.05, 0.75) if taps else (),
            )
        )
    return tuple(performances)


def render_placeholder(performance, path, camera):
    """Write a file in place of a performance's film, of no frames."""
    path.write_bytes(path.stem.encode())
    return np.empty(0), np.empty(0, np.intp)


# Projects and tracks

#: The actions of `make_foam_project`.
FOAM_ACTIONS = ("grab", "hold", "release")
#: What Ada painted in `make_painted_project`.
PAINTED_TRACK = (
    Segment(1.0, 2.0, "grab"),
    Segment(2.0, 4.5, "hold"),
    Segment(5.0, 5.25, "grab"),
    Segment(6.0, 8.0, "release"),
)
#: What Ann labelled in `make_training_project`, and what `run_result_of` has predicted.
TRAINING_TRACK = (Segment(0.0, 2.0, "grab"), Segment(2.0, 5.0, "hold"))
PREDICTED_TRACK = (Segment(0.0, 2.5, "grab"), Segment(2.5, 6.0, "hold"), Segment(6.0, 7.0, "grab"))


def make_foam_project(path: Path, tracks: tuple[tuple[str, tuple[Segment, ...]], ...]) -> None:
    """A project of one demonstration with these tracks."""
    recording = foam_demonstration()
    with Project.create(path) as project:
        project.demonstrations.add(recording)
        project.actions.set_vocabulary("foam", Vocabulary().with_actions(*FOAM_ACTIONS))
        for author, track in tracks:
            project.tracks.edit(recording.id, author, (), track, "made") if track else None


def make_filmed_project(path: Path, tracks: tuple[tuple[str, tuple[Segment, ...]], ...]) -> None:
    """A project with these tracks of a demonstration whose video starts 0.4 s before its forces."""
    filmed = demonstration_with_video(path.parent, ClockMap(-0.4))
    with Project.create(path) as project:
        project.demonstrations.add(filmed)
        for author, track in tracks:
            project.tracks.edit(filmed.id, author, (), track, "painted")


def add_foam_demonstration(project: Project, name: str) -> str:
    """Add one like that of `make_foam_project`, with other signals; gives its id."""
    recording = foam_demonstration()
    other = replace(recording, name=name, signals=recording.signals + 1)
    return project.demonstrations.add(other).id


def remove_demonstration(project: Project, id_: str) -> None:
    """Remove a demonstration with the labels of everybody."""
    authors = project.demonstrations.info(id_).authors
    heads = {author: project.tracks.head(id_, author) for author in authors}
    project.demonstrations.remove_all({id_: heads})


def make_painted_project(path, segments, seconds):
    """A project of two demonstrations; Ada has painted on the first one."""
    times = np.arange(int(seconds * 100)) / 100
    first = Demonstration("01", "foam", times, np.sin(times)[:, None], (Channel("f", "N"),))
    second = Demonstration("02", "foam", times, np.cos(times)[:, None], (Channel("f", "N"),))
    with Project.create(path) as project:
        track = (Track("Ada", segments),) if segments else ()
        project.demonstrations.add_all([NewDemonstration(first, track), NewDemonstration(second)])


def make_training_project(path, labelled, tasks):
    """A project with three demonstrations of each task, some labelled by Ann."""
    with Project.create(path) as project:
        for number, task in enumerate(tasks):
            for place, name in enumerate(("01", "02", "03")):
                demonstration = sine_demonstration(name, task, number + 0.1 * place)
                project.demonstrations.add(demonstration)
                if name in labelled:
                    project.tracks.edit(demonstration.id, "Ann", (), TRAINING_TRACK, "made")


def make_labelled_project(
    path: Path, labelled: int = 3, bare: int = 1, rate: float = 100.0
) -> Path:
    """A project of one task: so many demonstrations labelled by Ada, and some without labels."""
    with Project.create(path) as project:
        for number, (demonstration, segments) in enumerate(synthetic_set(labelled + bare, rate)):
            tracks = [Track("Ada", segments)] if number < labelled else []
            project.demonstrations.add(demonstration, tracks)
    return path


@contextmanager
def track_editor_in_memory() -> Iterator[TrackEditor]:
    """Ada at work on the only demonstration of a project, ten seconds long."""
    with folder_in_memory() as folder, Project.create(folder / "p.forcelab") as project:
        yield TrackEditor(project, project.demonstrations.add(quiet_demonstration()).id, "Ada")


def stored_track(editor: TrackEditor) -> Segments:
    """The track as another window reads it."""
    with Project.open(editor.project.path) as other:
        return other.tracks.get(editor.demonstration, editor.author).segments


# Settings, runs and results

#: Small enough for a fit in a tenth of a second, and in no time.
QUICK_SETTINGS = Settings(max_scale=64.0, stride=4, threshold=0.5, median=5, seed=3)
BAYES_SETTINGS = preset("paper").replace(classifier="naive-bayes", max_scale=32.0)
#: With these a small project is evaluated in a tenth of a second.
FAST_OPTIONS = ["--classifier", "naive-bayes", "--max-scale", "64", "--jobs", "1"]
FOAM_SELECTION = DataSelection(("foam",))
NO_PROVENANCE = Provenance(settings={}, seed=None, labels=(), versions={})


def make_evaluated_project(
    path: Path,
    settings: Settings = QUICK_SETTINGS,
    count: int = 4,
    rate: float = 100.0,
    folds: int = 0,
) -> RunResult:
    """Make a project of synthetic demonstrations, labelled by Ann, and evaluate on it."""
    pairs = synthetic_set(count, rate=rate)
    with Project.create(path) as project:
        for demonstration, segments in pairs:
            project.demonstrations.add(demonstration)
            project.tracks.edit(demonstration.id, "Ann", (), segments, "made")
        project.actions.add("foam", dict.fromkeys(s.action for _, t in pairs for s in t))
        return evaluate_as_run(
            project, [LabelledDemonstration(*pair) for pair in pairs], settings, folds
        )


def evaluate_as_run(
    project: Project, labelled: list[LabelledDemonstration], settings: Settings, folds: int = 0
) -> RunResult:
    """Evaluate as a run of the project would."""
    from forcelab.recognition.cross_validation import leave_one_out_job

    evaluation = finish(leave_one_out_job(labelled, settings, "foam", folds=folds))
    ids = [item.demonstration.id for item in labelled]
    return unscored_run_result(
        [replace(item.result, task="foam") for item in evaluation.tested],
        evaluation.actions,
        settings=settings,
        labels=tuple(LabelsUsed(id_, "Ann", project.tracks.head(id_, "Ann")) for id_ in ids),
        seconds=evaluation.seconds,
        folds=folds,
    )


def demonstration_result(id_, human, predicted, raw=None, probability_trace=None, task="foam"):
    """One demonstration of ten seconds; segments are (start, end, action)."""
    stages = {"filtered": tuple(Segment(*s) for s in predicted)}
    if raw is not None:
        stages["raw"] = tuple(Segment(*s) for s in raw)
    human = tuple(Segment(*s) for s in human)
    return DemonstrationResult(
        id_, f"{task} {id_}", task, 0.0, 10.0, human, stages, probability_trace
    )


def unscored_run_result(tested=(), actions=FOAM_ACTIONS, **changes):
    """A run's result without scores: Ann's labels of the foam, unless the changes say otherwise."""
    values = {
        "number": 1,
        "time": datetime(2026, 1, 1, tzinfo=timezone.utc),
        "title": "foam",
        "tasks": ("foam",),
        "test_task": None,
        "author": "Ann",
        "apart": False,
        "settings": Settings(),
        "labels": (),
    }
    return RunResult(**(values | changes), actions=tuple(actions), tested=tuple(tested))


def run_result(tested, actions, number=1, settings=None):
    """A run's result with the scores that ``forcelab evaluate`` would find."""
    scores, single = {}, [{} for _ in tested]
    for stage in ("raw", "filtered"):
        counts = [count_segments(d.human, d.stages.get(stage, ()), actions) for d in tested]
        scores[stage] = {"pooled": pool("pooled", counts).to_json() if counts else {}}
        for d, count, each in zip(tested, counts, single, strict=True):
            each[stage] = pool(d.name, [count]).to_json()
    tested = [replace(d, scores=each) for d, each in zip(tested, single, strict=True)]
    return unscored_run_result(
        tested,
        actions,
        number=number,
        time=datetime(2026, 1, number, tzinfo=timezone.utc),
        author="Ada",
        settings=settings or Settings(),
        scores=scores,
    )


def random_run_result(ids, actions, seed=0, right=0.75, number=1):
    """Demonstrations whose segments are predicted right for a share, else confused or missed."""
    random = np.random.default_rng(seed)
    tested = []
    for id_ in ids:
        edges = np.linspace(0.0, 10.0, 12).round(3).tolist()
        which = random.integers(0, len(actions), 11).tolist()
        human = [(a, b, actions[w]) for a, b, w in zip(edges, edges[1:], which, strict=False)]
        predicted, raw = [], []
        for (start, end, action), w in zip(human, which, strict=True):
            shift = float(random.uniform(0, 0.2))
            near = actions[(w + int(random.integers(1, 3))) % len(actions)]
            guess = action if random.random() < right else near
            raw += [(start, start + 0.3, near), (start + 0.3, end, guess)]
            if random.random() < 0.9:
                predicted.append((round(start + shift, 3), end, guess))
        values = random.integers(60, 255, (500, len(actions))).astype(np.uint8)
        trace = ProbabilityTrace(0.0, 50.0, tuple(actions), values)
        tested.append(demonstration_result(id_, human, predicted, raw, trace))
    return run_result(tested, actions, number)


def grab_probabilities(*parts, rate=50.0):
    """Stretches of (seconds, probability of grab)."""
    grab = np.concatenate([np.full(round(seconds * rate), p) for seconds, p in parts])
    values = np.rint(np.stack([grab, 1 - grab], axis=1) * 255).astype(np.uint8)
    return ProbabilityTrace(0.0, rate, ("grab", "hold"), values)


def add_run(project: Project, **result: object) -> int:
    """Store a run of which nothing is asked but that it is there; gives its number."""
    return project.runs.add("evaluate", NO_PROVENANCE, result=result)


def run_result_of(project, number=1, task="foam", author="Ann", proposed=(), **changes):
    """A run that has tested every labelled demonstration of a task."""
    infos = project.demonstrations.infos(task)
    trace = grab_probabilities((2.5, 0.97), (3.5, 0.2), (1.0, 0.6), (3.0, 0.9))

    def reviewed(info, human):
        return DemonstrationResult(
            info.id, info.name, task, 0.0, 10.0, human, {"filtered": PREDICTED_TRACK}, trace
        )

    result = RunResult(
        number=number,
        time=datetime(2026, 3, 1, 12, number % 60, tzinfo=timezone.utc),
        title=task,
        tasks=(task,),
        test_task=None,
        author=author,
        apart=False,
        settings=preset("ensemble"),  # as the window trains
        actions=("grab", "hold"),
        labels=tuple(LabelsUsed(i.id, author, project.tracks.head(i.id, author)) for i in infos),
        tested=tuple(
            reviewed(i, project.tracks.get(i.id, author).segments) for i in infos if i.labelled
        ),
        proposals=tuple(reviewed(i, ()) for i in infos if not i.labelled),
        recogniser=project.runs.add_recogniser("tiny", b"tiny", NO_PROVENANCE),
        seconds={"features": 0.25, "fit": 3.5, "predict": 0.1, "filter": 0.05},
    )
    return replace(result, **changes)


#: The module of somebody else, which leaves a mark when it is imported.
FOREIGN_MODULE = """
import os
import pathlib
import threading
from subprocess import Popen

import numpy as np

pathlib.Path(__file__).with_name("imported").touch()


class NearestMean:
    def __init__(self, scale=1.0):
        self.scale = scale

    def fit(self, X, y):
        self.classes_ = np.unique(y)
        self.means_ = np.stack([X[y == code].mean(axis=0) for code in self.classes_])
        return self

    def predict_proba(self, X):
        far = ((X[:, None, :] - self.means_) ** 2).mean(axis=2)
        near = np.exp(far.min(axis=1, keepdims=True) - far)
        return near / near.sum(axis=1, keepdims=True)

    def predict(self, X):
        return self.classes_[self.predict_proba(X).argmax(axis=1)]


class Locked(NearestMean):
    def fit(self, X, y):
        with open("fitted", "a") as file:
            print(len(X), file=file)
        self.lock = threading.Lock()
        return super().fit(X, y)


def energy(signals, rate):
    return np.square(np.gradient(signals, axis=0) * rate)


def make_nearest():
    return NearestMean()


def fail():
    raise ArithmeticError("out of\\ncheese")
"""
