"""ROS bags: of robots, and of whatever else records its topics with ROS 1 or ROS 2.

What the messages hold is told by the definitions in the bag, so that custom messages are read as
the common ones are. Which of their numbers are forces: :mod:`~forcelab.formats.rosbag.fields`. How
several topics come onto one clock: :mod:`~forcelab.formats.rosbag.aligning`.
"""

from forcelab.formats.rosbag.reader import read, sniff

__all__ = ["read", "sniff"]
