"""From many designs to what is asked of them: searches, statistics, counts."""
