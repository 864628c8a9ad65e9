"""From a scene to the stages that have to be computed, in blocks and shards."""
