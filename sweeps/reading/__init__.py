"""Files of other people: what they are, what they hold, and what is refused."""
