"""From a plan to results: computed, kept in archives, reduced, and joined."""
