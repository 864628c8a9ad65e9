"""From archives and scenes to decisions: `explore` searches them, `optimise` looks for designs."""
