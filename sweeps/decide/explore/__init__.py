"""Archives are opened, searched, compared and exported."""
