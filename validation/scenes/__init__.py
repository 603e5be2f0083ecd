"""Scenes: TOML in, validated tables out (pydantic), refused with one line where impossible."""
