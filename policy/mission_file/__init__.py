"""Campaign files (TOML): read, checked, turned into a :class:`Mission`; then opened with their users.

``load_mission`` for files and names, ``parse_mission`` for documents that came as JSON, ``open_campaign`` for the
scenario with one collection rate a user and the users' places. Whatever is wrong is one :class:`MissionError`.
"""

from policy.mission_file.mission import Mission, MissionError, Source, UserSource
from policy.mission_file.opening import open_campaign
from policy.mission_file.reader import load_mission, parse_mission, parse_mission_text
from policy.mission_file.shelf import find_mission, list_missions
from policy.mission_file.variants import vary

__all__ = [
    "Mission",
    "MissionError",
    "Source",
    "UserSource",
    "find_mission",
    "list_missions",
    "load_mission",
    "open_campaign",
    "parse_mission",
    "parse_mission_text",
    "vary",
]
