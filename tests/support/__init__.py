"""Helpers that several test files share, one subject a file."""
