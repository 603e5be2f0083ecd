"""Scenes: TOML in, validated tables out (pydantic); an invalid one is refused with one line."""
