"""Scenes: what a person wants computed, read and checked."""
