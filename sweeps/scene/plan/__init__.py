"""From a scene to the stages that have to be computed, in blocks and shards.

leaves, plan     what is given; the stages that the asked quantities need, and their axes
variations       plans with other values, for elasticities and uncertainty
blocks, shards   how a plan is divided, and what memory it takes
forecast         what `engine-dyn plan` prints
"""
