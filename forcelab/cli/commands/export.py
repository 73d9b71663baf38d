"""Write labels for other programs, or a whole project as one archive.

Tables:
  csv           one per demonstration, one row per segment: start,end,action,author
  table         one of all, one row per segment, for statistics; the column proposed_by
                names the model whose prediction the coder accepted
  samples       one per demonstration, labelled or not, one row per sample: forces, labels
                of each coder, and what the task's latest run predicts, with its probability
  parquet       the same as Parquet (extra parquet)
For other programs:
  elan          one .eaf per demonstration, one tier per coder; the task's actions as
                vocabulary, videos linked, the forces beside it as a time series
  textgrid      one TextGrid of Praat per demonstration, one tier per coder
  boris         one .boris project, one observation per coder and demonstration, videos
                linked
  label-studio  one task per demonstration, its forces as a time series: labels of coders
                as annotations, those of models as predictions; and the labelling
                interface (.xml). Label Studio shows the files once its
                LABEL_STUDIO_LOCAL_FILES_DOCUMENT_ROOT is the innermost folder that
                holds DIR and the project
  label-studio-video
                the same on the first video of each, as timelines of frames
  audacity      one label track per coder and demonstration
Datasets and projects:
  lerobot       the subtask of each frame, into the LeRobot dataset that was imported
                (--into, extra lerobot); unlabelled frames get a subtask of that name
  archive       one zip with everything; 'forcelab import' reads it back
Times are seconds from the start of the forces (elan: milliseconds).

for example:
  forcelab export lab.forcelab --out labels --format table --task stylus
  forcelab export lab.forcelab --out backup --format archive
  forcelab export lab.forcelab --format lerobot --into datasets/pull_pen --author Ines
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from pathlib import Path

from forcelab.cli.files import print_file, refuse_terminal
from forcelab.cli.options import UsageError, add_author, add_json, add_project, add_task, path_of
from forcelab.cli.output import STANDARD_OUTPUT, print_remark, print_result
from forcelab.errors import InputError
from forcelab.formats.export import FORMATS, exporting
from forcelab.formats.samples import Prediction
from forcelab.jobs import finish
from forcelab.project import DemonstrationInfo, Project
from forcelab.text import counted


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    places = parser.add_mutually_exclusive_group(required=True)
    places.add_argument(
        "--out", metavar="DIR", type=Path, help="folder to write into; - prints a single file"
    )
    places.add_argument(
        "--into",
        metavar="DATASET",
        type=path_of,
        help="dataset whose episodes were labelled (with --format lerobot); it is replaced as a "
        "whole or stays as it is",
    )
    parser.add_argument("--format", choices=FORMATS, default="csv", help="what to write (csv)")
    group = parser.add_argument_group("what is written")
    add_task(group, "only this; may be repeated", action="append")
    group.add_argument("--demo", metavar="NAME", action="append", help="only this; may be repeated")
    add_author(group, "only this; may be repeated", action="append")
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    chosen = arguments.task or arguments.demo or arguments.author
    if chosen and arguments.format == "archive":
        raise UsageError("An archive holds the whole project; leave out what chooses of it.")
    if (FORMATS[arguments.format].per == "dataset") != (arguments.into is not None):
        raise UsageError("Labels go into a dataset (--into) with --format lerobot, and only then.")
    if arguments.out == STANDARD_OUTPUT:
        _print(arguments)
    else:
        written = [str(path) for path in _export(arguments, arguments.out or arguments.into)]
        print_result(arguments.json, {"written": written}, "\n".join(written))
    if arguments.format == "archive":
        return
    authors = arguments.author
    infos = _infos(arguments)
    if bare := sum(not {*info.authors}.intersection(authors or info.authors) for info in infos):
        what = f"{counted(bare, 'demonstration')} {'has' if bare == 1 else 'have'} no labels"
        print_remark(f"{what}{' by these authors' if authors else ''} yet.")


def _export(arguments: argparse.Namespace, out: Path) -> tuple[Path, ...]:
    ids = {info.id for info in _infos(arguments)} if arguments.task or arguments.demo else None
    job = exporting(
        arguments.project,
        out,
        arguments.format,
        ids,
        authors=arguments.author,
        predictions=_predictions,
    )
    return finish(job)


def _predictions(project: Project) -> Mapping[str, Prediction]:
    from forcelab.review.run_result import latest_predictions  # slow, and few formats hold any

    return latest_predictions(project)


def _print(arguments: argparse.Namespace) -> None:
    """Write what would be the only file to standard output."""
    format_ = FORMATS[arguments.format]
    if arguments.json or not format_.prints:
        form = "what --json tells of" if arguments.json else f"the format {arguments.format}"
        raise UsageError(f"For {form} name a folder: --out - prints a single file.")
    if format_.binary:
        refuse_terminal()
    with tempfile.TemporaryDirectory(prefix="forcelab-") as folder:
        files = _export(arguments, Path(folder))
        if len(files) > 1:
            raise UsageError(
                f"{len(files)} files cannot be printed as one; name a folder, choose one of them, "
                f"or print all of it with --format table."
            )
        print_file(files[0])


def _infos(arguments: argparse.Namespace) -> list[DemonstrationInfo]:
    """The demonstrations of the requested tasks and names, each of which narrows the other."""
    with Project.open(arguments.project) as project:
        infos = list(project.demonstrations.infos())
        for task in arguments.task or ():
            project.demonstrations.check_task(task)
        if arguments.task:
            infos = [info for info in infos if info.task in arguments.task]
        if not arguments.demo:
            return infos
        ids, named = {info.id for info in infos}, set[str]()
        for name in arguments.demo:
            # A name of several tasks is clear in one of them.
            same = {info.id for info in infos if arguments.task and info.name == name}
            found = same or ids & {project.demonstrations.id_of(name)}
            if not found:
                tasks = ", ".join(arguments.task)
                raise InputError(
                    f"'{name}' is not of {tasks}; leave out --task, or choose its own."
                )
            named |= found
    return [info for info in infos if info.id in named]
