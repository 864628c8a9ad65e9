"""Engines, scenes and shafts that come with the package: TOML and CSV files, and where they lie."""

from __future__ import annotations

from pathlib import Path

__all__ = ["ENGINES", "ENGINE_TEMPLATE", "PACKAGE", "SCENES", "SHAFTS"]

PACKAGE = Path(__file__).resolve().parents[1]  # Folder of the package `sweeps`

ENGINES = Path(__file__).resolve().parent / "engines"  # Folder of the engines' files

SCENES = Path(__file__).resolve().parent / "scenes"  # Folder of the built-in scenes

SHAFTS = Path(__file__).resolve().parent / "shafts"  # Folder of the built-in shafts

ENGINE_TEMPLATE = Path(__file__).resolve().parent / "templates" / "engine.toml"
"""A commented engine file to start from."""
