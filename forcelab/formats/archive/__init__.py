"""A whole project as one file: a zip of readable JSON and plain arrays.

::

    forcelab.json                            what this is, and the version of the archive
    vocabularies.json                        the actions of each task
    demonstrations/ID/demonstration.json     name, task, channels, rate, video, source, notes
    demonstrations/ID/times.npy signals.npy  seconds (n,) and channels (n, c), 64-bit numbers
    demonstrations/ID/video-DIGEST.mp4       the video, if there is one
    demonstrations/ID/truth.json             what a simulation knows of it, if it is simulated
    demonstrations/ID/tracks.json            every author's segments as they are now
    edits.json                               every edit ever made, the first one first
    assignments.json                         who was to label what and when it was done
    verdicts.json                            what people said where labels and predictions differ
    recognisers.json recognisers/ID.skops    recognisers, and how they were made
    runs.json                                runs, the first one first, and how to repeat them

ID is the hash of a demonstration's or a recogniser's content, and DIGEST that of a video's; all are
checked when an archive is read. The same project always gives the same bytes.
"""

from forcelab.formats.archive.reader import read, read_archive, sniff
from forcelab.formats.archive.writer import write_archive

__all__ = ["read", "read_archive", "sniff", "write_archive"]
