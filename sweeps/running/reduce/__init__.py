"""From many designs to what is asked of them: searches, statistics, counts.

every_point, kept_front   designs judged at every point of some axes; fronts that grow
reduction                 blocks of a run are reduced as they are computed
statistics, searches      its parts
indices                   the part that Saltelli's design makes possible
ranges                    reading a range of values at a time
"""
