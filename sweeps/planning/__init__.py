"""From a scene to the stages that have to be computed, in blocks and shards.

leaves, plan     what is given; the stages that the asked quantities need, and their axes
blocks, shards   how a plan is cut
forecast, memory what `engine-dyn plan` prints; whether it fits the memory
"""
