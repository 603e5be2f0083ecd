"""Scenes: TOML in, validated tables out (pydantic), refused with one line where impossible."""

from validation.scenes.load import BUILT_IN, load_scene
from validation.scenes.tables import Scene

__all__ = ["BUILT_IN", "Scene", "load_scene"]
