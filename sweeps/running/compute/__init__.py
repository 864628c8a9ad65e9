"""Computing a plan: in memory, into an archive, on a cluster.

in_memory                   the stages in order, block by block, as arrays; `run`
elasticities, uncertainty   what follows from the results of plans with other values
into_archive, streaming     block by block into a file; `stream`
cluster, worker             on other processes and machines
options, limits             what a run is asked for; room in memory and on the disk
"""
